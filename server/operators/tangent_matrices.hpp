// K and D side by side on one pattern of 3x3 blocks, each as its upper triangle: both are symmetric.
#pragma once

#include "server/elements/column_lanes.hpp"
#include "server/solve/block_matrix.hpp"

namespace palpate {

class TangentMatrices {
 public:
  /// One block of K, and of D, row by row.
  using Pair = Eigen::Array<double, 18, 1>;

  TangentMatrices() = default;
  explicit TangentMatrices(BlockPattern pattern) : pattern_(std::move(pattern)), pairs_(pattern_.block_count()) {}

  const BlockPattern& pattern() const { return pattern_; }
  void set_zero() { std::fill(pairs_.begin(), pairs_.end(), Pair(Pair::Zero())); }
  Pair& at(std::uint32_t entry) { return pairs_[entry]; }
  /// Computes c_k K + c_d D, block by block; `sum` has the same pattern.
  void assemble(double c_d, double c_k, BlockMatrix& sum) const;
  /// Computes K Y and D Y for the columns of Y.
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const;
  /// Computes (c_k K + c_d D) Y, at a lower cost than both products.
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const;

 private:
  BlockPattern pattern_;
  std::vector<Pair> pairs_;
};

}  // namespace palpate
