// Solves A x = b for the symmetric positive definite block matrices of the integrator and the reduction.
//
// Small systems: sparse L D L^T (Eigen, approximate minimum degree), analysed once per pattern. Large systems, and small ones
// that are dominated by their diagonal (a short time step: the mass rules), where a handful of products is cheaper than one
// substitution: conjugate gradients with 3x3 blocks, preconditioned by SSOR (ssor_cg.hpp), warm-started by the caller's x.
//
// The iterations run in single precision on a packed copy of A (half the memory traffic, which is what limits them); residuals
// are taken in double precision, and the answer is refined until they meet the tolerance. A tolerance down to about 1e-12 can be
// met.
#pragma once

#include <Eigen/SparseCholesky>
#include <memory>
#include <span>
#include <vector>

#include "server/body/batch_cg.hpp"
#include "server/body/block_matrix.hpp"
#include "server/body/ssor_cg.hpp"

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

  /// Takes the values of A. False when A is not positive definite (direct: found here; iterative: found by solve()).
  /// The iterative method keeps a reference to A: it must live and stay unchanged until the next factorise().
  bool factorise(const BlockMatrix& a);
  /// x holds the first guess (iterative) and the answer. `tolerance` is relative to |b| (iterative).
  SolveStats solve(const Vector& b, double tolerance, Vector& x);
  /// The same for several, side by side; a tolerance below BatchConjugateGradients::kTightest is not met. `held` are the nodes
  /// whose rows and columns are those of the identity.
  SolveStats solve(std::span<const SolveColumn> columns, double tolerance, const std::vector<std::uint8_t>& held);
  /// True if the matrix of the last factorise() was factorised, rather than kept for conjugate gradients.
  bool is_direct() const { return direct_; }

 private:
  bool wants_direct(const BlockMatrix& a) const;
  bool factorise_direct(const BlockMatrix& a);
  SolveStats refine(const Vector& b, double tolerance, Vector& x);

  Method method_;
  bool small_, direct_ = false;
  // direct
  Eigen::SparseMatrix<double> lower_;
  std::vector<std::pair<std::uint32_t, int>> sources_;  // value k of lower_ = component `second` of block `first`
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> ldlt_;
  bool analysed_ = false;
  // iterative
  const BlockMatrix* a_ = nullptr;
  SsorConjugateGradients ssor_;
  BatchConjugateGradients batch_;
  bool batched_ = false;  // batch_ has the matrix of the last factorise()
  Vector r_;
};

}  // namespace palpate
