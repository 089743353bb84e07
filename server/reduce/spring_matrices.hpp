// K and D of springs, side by side on one pattern of 3x3 blocks. With n, T', s, L and b of element_kernel.hpp a spring adds
//
//     w_p w_q k  to block (p, q) of K,   w_p w_q d  to that of D,      k = (T' - s/L) n n^T + s/L I,   d = b n n^T
//
// where w are the shares with which coordinates move its ends. So every block is symmetric, and so are the matrices: of each the
// upper triangle is kept, six numbers a block.
#pragma once

#include "server/body/block_matrix.hpp"
#include "server/body/column_lanes.hpp"
#include "server/body/element_kernel.hpp"

namespace palpate {

class SpringMatrices {
 public:
  /// One block of either: K xx xy xz yy yz zz, and D.
  using Pair = Eigen::Array<double, 12, 1>;
  /// k and d of one spring.
  static Pair tangents(const Element& element, const ElementState& s);
  /// What k gains where the softening of a compressed spring is left out.
  static Pair clamping(const ElementState& s);

  SpringMatrices() = default;
  explicit SpringMatrices(BlockPattern pattern) : pattern_(std::move(pattern)), pairs_(pattern_.block_count()) {}

  const BlockPattern& pattern() const { return pattern_; }
  void set_zero() { std::fill(pairs_.begin(), pairs_.end(), Pair(Pair::Zero())); }
  Pair& at(std::uint32_t entry) { return pairs_[entry]; }
  /// c_k K + c_d D, block by block; `sum` has the same pattern.
  void assemble(double c_d, double c_k, BlockMatrix& sum) const;
  /// K Y and D Y for the columns of Y.
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const;
  /// (c_k K + c_d D) Y, for less than both.
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const;

 private:
  BlockPattern pattern_;
  std::vector<Pair> pairs_;
};

}  // namespace palpate
