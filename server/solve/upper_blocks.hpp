// The upper half of a symmetric matrix of 3x3 blocks, as conjugate gradients for several columns read it (batch_cg.hpp): in
// single precision, a block for each pair of nodes, row by row, and the blocks of the diagonal in double.
#pragma once

#include <cstdint>
#include <vector>

#include "server/solve/block_matrix.hpp"

namespace palpate {

struct UpperBlocks {
  struct Pair {  // block (i, column) of the row i that it belongs to, i < column
    float block[9];
    std::uint32_t column;
  };
  std::vector<std::uint32_t> first;  ///< pairs of row i: first[i] ... first[i + 1] - 1
  std::vector<Pair> pairs;
  std::vector<Mat3> diagonal;

  /// Makes it a matrix of so many nodes, without pairs yet.
  void clear(std::uint32_t nodes) {
    first.assign(1, 0);
    pairs.clear();
    diagonal.assign(nodes, Mat3::Zero());
  }
  void end_row() { first.push_back(static_cast<std::uint32_t>(pairs.size())); }
  /// A copy.
  void take(const BlockMatrix& a) {
    clear(a.rows());
    for (std::uint32_t i = 0; i < a.rows(); ++i) {
      for (std::uint32_t e = a.row_begin(i); e < a.row_end(i); ++e) {
        if (a.column(e) <= i) continue;
        Pair& pair = pairs.emplace_back();
        pair.column = a.column(e);
        Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(pair.block) = a.block(e).cast<float>();
      }
      end_row();
      diagonal[i] = a.block(a.diagonal(i));
    }
  }
};

}  // namespace palpate
