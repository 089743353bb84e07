// A sparse symmetric matrix of 3x3 blocks on a pattern that changes where it is widened alone (one block row a node).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// Both triangles: a product is then one sweep over contiguous rows. The upper one alone, where what is asked for is symmetric.
enum class Triangles { both, upper };

/// Rows and columns of the blocks.
class BlockPattern {
 public:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;

  BlockPattern() = default;
  /// The diagonal and both blocks of every pair, or the upper one.
  BlockPattern(std::uint32_t rows, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs, Triangles triangles);

  std::uint32_t rows() const { return static_cast<std::uint32_t>(first_.size()) - 1; }
  std::uint32_t row_begin(std::uint32_t row) const { return first_[row]; }
  std::uint32_t row_end(std::uint32_t row) const { return first_[row + 1]; }
  std::uint32_t column(std::uint32_t entry) const { return columns_[entry]; }
  std::uint32_t diagonal(std::uint32_t row) const { return diagonal_[row]; }
  /// Entry of block (row, column), which must be in the pattern.
  std::uint32_t find(std::uint32_t row, std::uint32_t column) const;
  std::uint32_t block_count() const { return static_cast<std::uint32_t>(columns_.size()); }

 protected:
  std::vector<std::uint32_t> first_, columns_, diagonal_;
};

class BlockMatrix : public BlockPattern {
 public:
  using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

  BlockMatrix() = default;
  explicit BlockMatrix(BlockPattern pattern) : BlockPattern(std::move(pattern)), values_(9 * std::size_t{block_count()}, 0.0) {}
  /// Both triangles.
  BlockMatrix(std::uint32_t rows, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs)
      : BlockMatrix(BlockPattern(rows, pairs, Triangles::both)) {}

  Eigen::Map<Block> block(std::uint32_t entry) { return Eigen::Map<Block>(values_.data() + 9 * std::size_t{entry}); }
  Eigen::Map<const Block> block(std::uint32_t entry) const {
    return Eigen::Map<const Block>(values_.data() + 9 * std::size_t{entry});
  }
  /// Adds zero blocks for pairs (a, b), a < b, ascending, to both triangles. Once: a copy of what it was before can be widened
  /// anew.
  void widen(std::vector<Pair> pairs);
  /// Pairs that it was widened by: matrices that began as one have the same pattern if these are the same.
  const std::vector<Pair>& widened_by() const { return widened_by_; }
  void set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

  /// y = A x, of both triangles.
  void multiply(const Vector& x, Vector& y) const;

 private:
  std::vector<double> values_;
  std::vector<Pair> widened_by_;
};

}  // namespace palpate
