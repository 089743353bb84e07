// Conjugate gradients for several right-hand sides side by side, in single precision, preconditioned by the 3x3 blocks of the
// nodes and, where there is one, by a coarse space (coarse_space.hpp):
//
//     A X = B,     A symmetric, rows and columns of held nodes those of the identity (Dynamics::assemble)
//
// Each column has its own coefficients, and another takes its place as soon as it is done; what the columns share is the way
// through the matrix, which is what a product costs. Of A the upper half is kept, a block for each pair of nodes that share an
// element, whatever the element is. Sums over nodes are in double precision and in a fixed order.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/body/coarse_space.hpp"
#include "server/solve/upper_blocks.hpp"

namespace palpate {

/// A column: x holds the first guess, of which only the direction counts, and the answer.
struct SolveColumn {
  const Vector* b = nullptr;
  Vector* x = nullptr;
  double tolerance_factor = 1;  ///< times the tolerance of the solve, where this one is needed less exactly than others
};

/// A correction from a coarse space: A_c^-1, and where in it each node is. Empty: none.
struct CoarseCorrection {
  std::shared_ptr<const CoarseInverse> inverse;
  std::span<const CoarseSpace::Node> nodes;  ///< must outlive the solves
};

class BatchConjugateGradients {
 public:
  static constexpr int kColumns = 8;
  static constexpr double kTightest = 1e-5;  ///< of |b|: single precision gets no further
  struct Lanes {
    double v[kColumns] = {};  ///< one number a column
  };

  /// Takes a copy of A.
  void prepare(const BlockMatrix& a, const std::vector<std::uint8_t>& held, CoarseCorrection coarse = {}) {
    a_.take(a);
    prepare(held, std::move(coarse));
  }
  /// A, to be filled before it is prepared.
  UpperBlocks& matrix() { return a_; }
  const UpperBlocks& matrix() const { return a_; }
  void prepare(const std::vector<std::uint8_t>& held, CoarseCorrection coarse);
  /// |A x - b| <= tolerance_factor max(tolerance, kTightest) |b| for each of any number of columns, as far as the recursion can
  /// tell. Rows of held nodes are taken for zero in b and are zero in x. Returns the iterations of all columns together.
  /// `positive_definite` becomes false, and the columns keep what was found so far, when a direction of non-positive curvature
  /// shows.
  int solve(std::span<const SolveColumn> columns, double tolerance, bool& positive_definite);

 private:
  struct alignas(32) Rows {  // what one node does in all columns
    float x[kColumns], y[kColumns], z[kColumns];
  };
  struct Symmetric {
    Symmetric() = default;
    explicit Symmetric(const Mat3& m);
    float xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  };
  bool load(const SolveColumn& column, int lane, double& scale, Lanes& along);
  void unload(const SolveColumn& column, int lane, double scale) const;
  Lanes multiply();
  void advance(const Lanes& alpha, Lanes& rr, Lanes& rz);
  void add_coarse(Lanes& rz);
  void turn(const Lanes& beta);

  UpperBlocks a_;
  std::vector<Symmetric> diagonal_, inverse_;  // and its inverse
  std::vector<float> free_;                    // 0 for a held node, 1 for others
  std::vector<Rows> x_, r_, z_, p_, ap_;
  CoarseCorrection coarse_;
  struct alignas(32) Row {
    float v[kColumns];
  };
  std::vector<Row> coarse_r_, coarse_z_;  // P^T r and A_c^-1 P^T r, of each motion; empty without a coarse space
};

}  // namespace palpate
