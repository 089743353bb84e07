// A coarse space for iterative solves with A = c_m M + c_d D + K: what a body does when parts of it move as rigid pieces.
//
// The nodes are gathered in boxes of a grid over the body at rest, some fifty in each but no more than kPiecesMost boxes. Piece p
// moves by u_p and turns by w_p:
//     node i in p:   x_i = u_p + w_p x (X_i - c_p),   c_p the mean of its free nodes; fixed nodes do not move
// These motions are the columns of P. With A_c = P^T A P the part of a residual r that is smooth over pieces is answered by
// P A_c^-1 P^T r: added to what each node answers for itself it makes the number of iterations nearly independent of how many
// nodes a body has (additive two-level Schwarz; Toselli and Widlund, Domain Decomposition Methods, 2005, chapter 3). A_c is that
// of the body at rest, and inverses are kept for coefficients within a quarter: it only has to be near.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "server/body/dynamics.hpp"

namespace palpate {

/// A_c^-1, row by row in single precision.
struct CoarseInverse {
  double c_m = 0, c_d = 0;
  std::size_t size = 0;  ///< motions of all pieces
  std::vector<float> rows;
};

class CoarseSpace {
 public:
  static constexpr int kMotions = 6;  ///< of a piece: along x, y, z, about x, y, z

  static constexpr std::size_t kPiecesMost = 64;  ///< more answer better, and cost the square of their number in every iteration

  /// At the body's rest, with no more than `pieces`. Empty for planar bodies.
  explicit CoarseSpace(const Dynamics& dynamics, std::size_t pieces = kPiecesMost);

  static constexpr std::uint32_t kNone = 0xffffffff;
  struct Node {
    float arm[3] = {};  ///< X_i - c_p [m]
    std::uint32_t piece = kNone;
  };
  const std::vector<Node>& nodes() const { return nodes_; }
  /// Columns of P: motions of all pieces. 0: empty.
  std::size_t size() const { return static_cast<std::size_t>(k_.rows()); }
  /// nullptr when A_c is not positive definite.
  std::shared_ptr<const CoarseInverse> inverse(double c_m, double c_d);

 private:
  void gather(const LumpedBody& body, std::size_t most);
  Eigen::Matrix<double, 3, kMotions> motions(std::uint32_t node) const;
  Matrix project(const BlockMatrix& a) const;

  std::vector<Node> nodes_;
  std::vector<bool> turns_;  // of each piece: its nodes do not lie on a line
  Matrix m_, d_, k_;
  std::deque<std::shared_ptr<const CoarseInverse>> inverses_;
};

}  // namespace palpate
