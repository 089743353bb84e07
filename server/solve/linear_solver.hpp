// Solves A x = b for the symmetric positive definite block matrices of the integrator and the reduction.
//
// Small systems: sparse L D L^T (Eigen, approximate minimum degree), analysed once per pattern. Large systems: conjugate
// gradients (ssor_cg.hpp), warm-started by the caller's x.
//
// The iterations run in single precision on a packed copy of A (half the memory traffic, which is what limits them); residuals
// are taken in double precision, and the answer is refined until they meet the tolerance. A tolerance down to about 1e-12 can be
// met.
#pragma once

#include <Eigen/SparseCholesky>
#include <vector>

#include "server/solve/ssor_cg.hpp"

namespace palpate {

struct SolveStats {
  int iterations = 0;  ///< of conjugate gradients; 0 for a direct solve
  bool positive_definite = true;
};

class LinearSolver {
 public:
  enum class Method { automatic, direct, conjugate_gradients };
  static constexpr std::uint32_t kDirectRowsMax = 600;  ///< nodes up to which `automatic` is direct
  /// True where factorising takes less time than conjugate gradients for a body of so many nodes that moves, whose matrix is
  /// seldom used twice (docs/decisions/0003-linear-solver.md).
  static bool factorises(std::uint32_t nodes, bool planar);

  explicit LinearSolver(std::uint32_t rows, Method method = Method::automatic);

  /// Takes the values of A, whose pattern may differ from that of the one before by what it was widened by. False when A is not
  /// positive definite (direct: found here; iterative: found by solve()). The iterative method keeps a reference to A: it must
  /// live and stay unchanged until the next factorise().
  bool factorise(const BlockMatrix& a);
  /// x holds the first guess (iterative) and the answer. `tolerance` is relative to |b| (iterative).
  SolveStats solve(const Vector& b, double tolerance, Vector& x);
  /// Returns true if matrices are factorised, rather than kept for conjugate gradients.
  bool is_direct() const { return direct_; }

 private:
  bool factorise_direct(const BlockMatrix& a);
  SolveStats refine(const Vector& b, double tolerance, Vector& x);

  bool direct_;
  // direct
  Eigen::SparseMatrix<double> lower_;
  std::vector<std::pair<std::uint32_t, int>> sources_;  // value k of lower_ = component `second` of block `first`
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> ldlt_;
  bool analysed_ = false;
  std::vector<BlockPattern::Pair> widened_by_;  // of the matrix whose pattern is known
  // iterative
  const BlockMatrix* a_ = nullptr;
  SsorConjugateGradients ssor_;
  Vector r_;
};

}  // namespace palpate
