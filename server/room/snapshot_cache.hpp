// Earlier states of the body, and states from warm-start indentations, kept as far as they differ: max |x - x_i| >
// kDifferenceEdges l for all kept states, l the body's mean edge [m], x 3 N [m]. A basis that includes some of them is more
// accurate where a hand presses again, and where it first meets a body at rest, which has no past (docs/notebook.md, 30).
//
// Among the states that had a tool within l of a present one and that differ enough from x, the most informative are chosen one
// by one, each the farthest from the span of x and those chosen before, as by pivoted Gram-Schmidt of x_i - x,
//
//     i_k = argmax |r_i^k|,   r_i^0 = x_i - x,   r_i^{k+1} = r_i^k - q_k q_k^T r_i^k,   q_k = r_{i_k}^k / |r_{i_k}^k|
//
// until kChosenMax are chosen or |r| is below kInformativeShare of the largest r^0. This works on the inner products of the x_i,
// which are stored, so it needs one pass over each of these states.
//
// Tool positions are mapped to the body at rest. All states are of one body.
//
// Source: Businger and Golub, Numer. Math. 7 (1965), for the pivots.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/body/dynamics.hpp"

namespace palpate {

class SnapshotCache {
 public:
  static constexpr double kDifferenceEdges = 0.1;  ///< in mean edges; measured: 0.02 to 0.2 are no better (docs/notebook.md, 30)
  static constexpr std::size_t kStatesMax = 64;    ///< 12 MB for 8,000 nodes
  static constexpr std::size_t kChosenMax = 8;     ///< measured: 4 and 6 are worse at 300 ms (docs/notebook.md, 30)

  explicit SnapshotCache(double mean_edge_m) : edge_m_(mean_edge_m) {}

  /// Keeps x, unless a kept state is near it. If the cache is full, x replaces the least recently used state.
  void keep(std::span<const Vec3> tools, const Vector& x);
  /// Returns the most informative states, kChosenMax at most, for a body at x, and marks those with tools near by as used.
  std::vector<const Vector*> most_informative(std::span<const Vec3> tools, const Vector& x);
  /// Returns true if both positions are within a mean edge of each other.
  bool alike(const Vec3& a, const Vec3& b) const { return (a - b).norm() <= edge_m_; }
  std::size_t size() const { return states_.size(); }
  void clear() { states_.clear(); }

 private:
  struct State {
    std::vector<Vec3> tools;
    Vector x;
    std::uint64_t of_use = 0;
  };
  bool near(const State& state, std::span<const Vec3> tools) const;
  bool apart(const Vector& a, const Vector& b) const;

  double edge_m_;
  std::vector<State> states_;
  Vector origin_;                                           // the first state that was kept
  Matrix products_ = Matrix::Zero(kStatesMax, kStatesMax);  // (x_i - origin) . (x_j - origin)
  std::uint64_t now_ = 0;
};

}  // namespace palpate
