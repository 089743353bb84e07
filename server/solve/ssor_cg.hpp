// Conjugate gradients preconditioned by symmetric successive over-relaxation over 3x3 blocks, in single precision.
//
// With A = L + D + L^T, D the blocks of the nodes, the preconditioner is (D + L) D^-1 (D + L^T). Scaled by the Cholesky factors
// of D, which makes D = I, and with C = I + L, the iterations run on
//
//     A^ = C^-1 A C^-T,     A^ p = t + C^-1 (p - t),     t = C^-T p
//
// so that an iteration costs two triangular solves, which read the blocks of A once, as one product does: Eisenstat's trick. It
// takes half the iterations that the blocks of the diagonal alone do (docs/decisions/0003-linear-solver.md).
//
// The tolerance is of the preconditioned residual, |C^-1 r|, which is near the energy norm of the error.
//
// Source: Eisenstat, Efficient implementation of a class of preconditioned conjugate gradient methods, SIAM J. Sci. Stat. Comput.
// 2 (1981).
#pragma once

#include <cstdint>
#include <vector>

#include "server/solve/block_matrix.hpp"

namespace palpate {

class SsorConjugateGradients {
 public:
  /// Copies A. The pattern is read the first time; later ones must have the same. False where a block of the diagonal is not
  /// positive definite.
  bool pack(const BlockMatrix& a);
  /// x += d with |C^-1 (A d - r)| <= tolerance |C^-1 r|, as far as single precision can tell; returns the number of iterations.
  /// `positive_definite` becomes false, and x keeps what was found so far, when a direction of non-positive curvature shows.
  int solve(const Vector& r, double tolerance, Vector& x, bool& positive_definite);

 private:
  /// x, y, z of a node and a zero, or a column of a 3x3 block and a zero.
  struct alignas(16) Quad {
    float v[4];
  };
  using Quads = std::vector<Quad>;
  /// Two blocks of a row, column beside column: (a_0c a_1c a_2c 0 | b_0c b_1c b_2c 0) for c = 0, 1, 2. A row with an odd number
  /// of blocks ends with a zero block.
  struct alignas(32) Pair {
    float columns[3][8];
  };
  struct Columns {
    std::uint32_t a = 0, b = 0;
  };
  /// Pairs of row k are first[k] ... first[k + 1] - 1.
  struct StrictTriangle {
    std::vector<std::uint32_t> first;
    std::vector<Columns> columns;
    std::vector<Pair> pairs;
  };
  struct Place {                                                         // of a block of the lower triangle in both
    std::uint32_t entry = 0, row = 0, column = 0, lower = 0, upper = 0;  // in A; in halves of pairs
  };

  void read_pattern(const BlockMatrix& a);
  static void put(const Quad (&columns)[3], std::uint32_t half, StrictTriangle& to);
  static Quad product(const StrictTriangle& triangle, std::size_t row, const Quads& x);
  void solve_upper(const Quads& p, Quads& t) const;
  template <class Use>
  void solve_lower(const Quads& q, Quads& y, const Use& use) const;

  StrictTriangle lower_, upper_;
  std::vector<Place> places_;
  std::vector<Mat3> scale_;  // S^-1 of each row, with D = S S^T before it was scaled
  Quads d_, r_, p_, t_, y_, q_;
};

}  // namespace palpate
