// Counts of a quantity in bins of equal width, of fixed size: percentiles of a long run without allocation.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace palpate {

/// Values from 0; those beyond the last bin are counted in it, and the largest value is kept exactly.
template <std::size_t kBins>
class Histogram {
 public:
  explicit Histogram(std::int64_t bin_width) noexcept : width_(bin_width) {}

  void add(std::int64_t value) noexcept {
    const std::int64_t positive = std::max<std::int64_t>(value, 0);
    ++bins_[std::min(static_cast<std::size_t>(positive / width_), kBins - 1)];
    ++count_;
    max_ = std::max(max_, positive);
  }

  std::uint64_t count() const noexcept { return count_; }
  std::int64_t max() const noexcept { return max_; }

  /// Number of values in the bins that end at or below `value`: those below it, when it is an edge. All, from the last bin on.
  std::uint64_t below(std::int64_t value) const noexcept {
    const auto bins = static_cast<std::size_t>(std::max<std::int64_t>(value, 0) / width_);
    if (bins >= kBins) return count_;
    std::uint64_t sum = 0;
    for (std::size_t bin = 0; bin < bins; ++bin) sum += bins_[bin];
    return sum;
  }

  /// Upper edge of the bin that holds the given share (0 to 1) of the values, never above the largest; 0 without values.
  std::int64_t percentile(double share) const noexcept {
    const auto wanted = static_cast<std::uint64_t>(share * static_cast<double>(count_));
    std::uint64_t seen = 0;
    for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
      seen += bins_[bin];
      if (seen > wanted || (seen == count_ && count_ > 0)) return std::min(static_cast<std::int64_t>(bin + 1) * width_, max_);
    }
    return max_;
  }

 private:
  std::int64_t width_, max_ = 0;
  std::uint64_t count_ = 0;
  std::array<std::uint32_t, kBins> bins_{};
};

}  // namespace palpate
