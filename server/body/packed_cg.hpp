// Conjugate gradients in single precision, 3x3 block-Jacobi preconditioned. Nodes are padded to 4 floats; blocks are 9 floats,
// column after column, read 4 at a time (what the fourth lane picks up of the next column is never used): one block is three
// 4-wide multiply-adds on 36 bytes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "server/body/block_matrix.hpp"

namespace palpate {

class PackedConjugateGradients {
 public:
  /// Takes a copy of A's values; the pattern is read from `a` again at each solve, so `a` must live.
  void pack(const BlockMatrix& a);
  /// x += d with |A d - r| <= tolerance |r| as far as single precision can tell; returns the number of iterations.
  /// `positive_definite` becomes false, and x keeps what was found so far, when a direction of non-positive curvature shows.
  int solve(const Vector& r, double tolerance, Vector& x, bool& positive_definite);

 private:
  using Node = Eigen::Vector4f;
  using Nodes = std::vector<Node, Eigen::aligned_allocator<Node>>;

  void multiply(const Nodes& x, Nodes& y) const;
  void precondition(const Nodes& r, Nodes& z) const;

  const BlockMatrix* a_ = nullptr;
  std::vector<float> blocks_, inverse_diagonal_;  // 9 a block, and one to read over at the end
  Nodes d_, r_, z_, p_, ap_;
};

}  // namespace palpate
