#include "server/body/linear_solver.hpp"

#include <algorithm>

namespace palpate {

LinearSolver::LinearSolver(std::uint32_t rows, Method method) : method_(method), small_(rows <= kDirectRowsMax) {}

bool LinearSolver::factorises(std::uint32_t nodes, bool planar) {
  constexpr std::uint32_t kFactorisedNodesMax = 100;  // measured: with 27 nodes it is as quick, with 125 and more it is not
  return nodes <= (planar ? kDirectRowsMax : kFactorisedNodesMax);
}

bool LinearSolver::wants_direct(const BlockMatrix& a) const {
  if (method_ != Method::automatic) return method_ == Method::direct;
  if (!small_) return false;
  // Gershgorin: with off-diagonal sums below this share of the diagonal the condition number stays under 4.
  constexpr double kDominance = 0.6;
  for (std::uint32_t i = 0; i < a.rows(); ++i) {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t e = a.row_begin(i); e < a.row_end(i); ++e) sum += a.block(e).cwiseAbs().rowwise().sum();
    const Vec3 diagonal = a.block(a.diagonal(i)).diagonal();
    if (((sum - diagonal).array() > kDominance * diagonal.array()).any()) return true;
  }
  return false;
}

bool LinearSolver::factorise(const BlockMatrix& a) {
  direct_ = wants_direct(a);
  if (direct_) return factorise_direct(a);
  a_ = &a;
  batched_ = false;
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

SolveStats LinearSolver::solve(std::span<const SolveColumn> columns, double tolerance, const std::vector<std::uint8_t>& held) {
  SolveStats stats;
  if (direct_) {
    for (const SolveColumn& column : columns) *column.x = ldlt_.solve(*column.b);
    return stats;
  }
  if (!batched_) batch_.prepare(*a_, held);
  batched_ = true;
  stats.iterations = batch_.solve(columns, tolerance, stats.positive_definite);
  return stats;
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
