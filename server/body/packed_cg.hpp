// Conjugate gradients in single precision, 3x3 block-Jacobi preconditioned. Nodes are padded to 4 floats. The blocks of a row go
// in pairs, column beside column: (a_0c a_1c a_2c 0 | b_0c b_1c b_2c 0) for c = 0, 1, 2, so that one pair is three 8-wide
// multiply-adds; a row with an odd number of blocks ends with a zero block.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "server/body/block_matrix.hpp"

namespace palpate {

class PackedConjugateGradients {
 public:
  /// Takes a copy of A; the pattern is taken the first time, later ones must have the same.
  void pack(const BlockMatrix& a);
  /// x += d with |A d - r| <= tolerance |r| as far as single precision can tell; returns the number of iterations.
  /// `positive_definite` becomes false, and x keeps what was found so far, when a direction of non-positive curvature shows.
  int solve(const Vector& r, double tolerance, Vector& x, bool& positive_definite);

 private:
  using Node = Eigen::Vector4f;
  using Nodes = std::vector<Node, Eigen::aligned_allocator<Node>>;

  void multiply(const Nodes& x, Nodes& y) const;
  void precondition(const Nodes& r, Nodes& z) const;

  struct alignas(32) Pair {
    float columns[3][8];
  };
  struct Neighbours {
    std::uint32_t a = 0, b = 0;
  };
  void take_pattern(const BlockMatrix& a);

  std::vector<std::uint32_t> first_;  // pairs of row i: first_[i] ... first_[i + 1] - 1
  std::vector<Neighbours> neighbours_;
  std::vector<Pair> pairs_;
  std::vector<Eigen::Matrix3f> inverse_diagonal_;
  Nodes d_, r_, z_, p_, ap_;
};

}  // namespace palpate
