#include "server/solve/linear_solver.hpp"

#include <algorithm>

namespace palpate {

LinearSolver::LinearSolver(std::uint32_t rows, Method method)
    : direct_(method == Method::direct || (method == Method::automatic && rows <= kDirectRowsMax)) {}

bool LinearSolver::factorises(std::uint32_t nodes, bool planar) {
  constexpr std::uint32_t kFactorisedNodesMax = 100;  // measured: with 27 nodes it is as quick, with 125 and more it is not
  return nodes <= (planar ? kDirectRowsMax : kFactorisedNodesMax);
}

bool LinearSolver::factorise(const BlockMatrix& a) {
  if (a.widened_by() != widened_by_) {
    widened_by_ = a.widened_by();
    analysed_ = false;
    sources_.clear();
    ssor_ = {};
  }
  if (direct_) return factorise_direct(a);
  a_ = &a;
  return ssor_.pack(a);
}

bool LinearSolver::factorise_direct(const BlockMatrix& a) {
  if (!analysed_) {
    // Column-major lower triangle; row i of the symmetric matrix is read as column i.
    const auto n = static_cast<Eigen::Index>(3 * a.rows());
    lower_.resize(n, n);
    for (std::uint32_t i = 0; i < a.rows(); ++i)
      for (int c = 0; c < 3; ++c) {
        const int column = static_cast<int>(3 * i) + c;
        lower_.startVec(column);
        for (std::uint32_t e = a.row_begin(i); e < a.row_end(i); ++e)
          for (int k = 0; k < 3; ++k) {
            const int row = static_cast<int>(3 * a.column(e)) + k;
            if (row < column) continue;
            lower_.insertBack(row, column) = 1;
            sources_.emplace_back(e, 3 * c + k);
          }
      }
    lower_.finalize();
  }
  double* values = lower_.valuePtr();
  for (const auto& [entry, component] : sources_) *values++ = a.block(entry).data()[component];
  if (!analysed_) ldlt_.analyzePattern(lower_);
  analysed_ = true;
  ldlt_.factorize(lower_);
  return ldlt_.info() == Eigen::Success && ldlt_.vectorD().minCoeff() > 0;
}

SolveStats LinearSolver::solve(const Vector& b, double tolerance, Vector& x) {
  if (!direct_) return refine(b, tolerance, x);
  x = ldlt_.solve(b);
  return {};
}

SolveStats LinearSolver::refine(const Vector& b, double tolerance, Vector& x) {
  constexpr double kInnerTolerance = 1e-4;  // single precision gets this far without losing its way
  constexpr int kRefinementsMax = 10;
  SolveStats stats;
  const double target = tolerance * b.norm();
  if (x.size() != b.size()) x = Vector::Zero(b.size());
  for (int k = 0; k < kRefinementsMax; ++k) {
    if (x.cwiseAbs().maxCoeff() > 0) {
      a_->multiply(x, r_);
      r_ = b - r_;
    } else {
      r_ = b;
    }
    const double norm = r_.norm();
    if (!(norm > target)) return stats;
    const double inner = std::max(kInnerTolerance, 0.9 * target / norm);
    stats.iterations += ssor_.solve(r_, inner, x, stats.positive_definite);
    // What one inner solve reaches is known from its own recursion, good enough where the tolerance is loose.
    if (!stats.positive_definite || inner > kInnerTolerance) return stats;
  }
  return stats;
}

}  // namespace palpate
