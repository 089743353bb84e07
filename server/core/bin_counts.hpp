// Histogram with fixed bin edges, for figures that are read while a program runs.
//
//     bin k    edge(k-1) < value <= edge(k)        the last bin holds what lies beyond the last edge
//
// It counts as Prometheus histograms do (https://prometheus.io/docs/concepts/metric_types/). It allocates nothing and has at most
// kMostEdges edges.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <numeric>
#include <span>

namespace palpate {

/// Edges for durations of frames, patches and round trips [s]. A frame at 20 Hz lasts 50 ms.
inline constexpr std::array<double, 15> kSecondsEdges{0.001, 0.002, 0.005, 0.01, 0.02, 0.035, 0.05, 0.075,
                                                      0.1,   0.15,  0.2,   0.3,  0.5,  1.0,   2.0};
/// Edges for the share of datagrams that got lost [0, 1].
inline constexpr std::array<double, 9> kShareEdges{0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3};

class BinCounts {
 public:
  static constexpr std::size_t kMostEdges = 15;

  /// `edges` must ascend and outlive this object.
  explicit BinCounts(std::span<const double> edges) : edges_(edges) { assert(edges.size() <= kMostEdges); }

  void add(double value) {
    const auto bin = std::lower_bound(edges_.begin(), edges_.end(), value) - edges_.begin();
    ++bins_[static_cast<std::size_t>(bin)];
    sum_ += value;
  }
  std::span<const double> edges() const { return edges_; }
  /// Counts of all bins: one more than there are edges.
  std::span<const std::uint64_t> bins() const { return std::span(bins_).first(edges_.size() + 1); }
  std::uint64_t count() const { return std::accumulate(bins_.begin(), bins_.end(), std::uint64_t{0}); }
  double sum() const { return sum_; }

 private:
  std::span<const double> edges_;
  std::array<std::uint64_t, kMostEdges + 1> bins_{};
  double sum_ = 0;
};

}  // namespace palpate
