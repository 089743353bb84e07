#include "server/reduction/basis.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

/// Builds an M-orthonormal basis, one vector at a time.
class Orthonormal {
 public:
  Orthonormal(const Vector& masses, int columns) : masses_(masses), v_(masses.size(), columns) {}

  bool full() const { return count_ == v_.cols(); }
  Eigen::Index room() const { return v_.cols() - count_; }
  void add(Vector y) {
    if (full()) return;
    assert(y.size() == masses_.size());
    const double before = norm(y);
    if (!(before > 0) || !std::isfinite(before)) return;
    for (int pass = 0; pass < 2; ++pass) {
      weighted_ = masses_.cwiseProduct(y);
      along_.noalias() = v_.leftCols(count_).transpose() * weighted_;
      y.noalias() -= v_.leftCols(count_) * along_;
    }
    const double after = norm(y);
    constexpr double kKrylovIndependentShare = 1e-5;  // of its length: solves are in single precision, accurate to 1e-5 at best
    if (after > kKrylovIndependentShare * before) v_.col(count_++) = y / after;
  }
  Matrix take() const { return v_.leftCols(count_); }

 private:
  double norm(const Vector& y) const { return std::sqrt(y.dot(masses_.cwiseProduct(y))); }
  const Vector& masses_;
  Matrix v_;
  Vector weighted_, along_;
  Eigen::Index count_ = 0;
};

}  // namespace

Matrix side_by_side(std::span<const Vector> columns) {
  assert(!columns.empty());
  Matrix w(columns.front().size(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) w.col(static_cast<Eigen::Index>(c)) = columns[c];
  return w;
}

std::vector<Vector> moment_inputs(const Linearisation& at, double shift_1_s, std::span<const Vector> x) {
  assert(shift_1_s >= 0);
  Matrix d_x;
  at.body->multiply_sum(side_by_side(x), 0, 1, d_x);
  std::vector<Vector> inputs;
  for (std::size_t k = 0; k < x.size(); ++k)
    inputs.emplace_back(2 * shift_1_s * at.masses().cwiseProduct(x[k]) + d_x.col(static_cast<Eigen::Index>(k)));
  return inputs;
}

bool ShiftedSolver::prepare(const Linearisation& at, double shift, bool clamp) {
  assert(at.body && at.held && shift >= 0);
  assert(3 * static_cast<Eigen::Index>(at.held->size()) == at.masses().size());
  iterations_ = 0;
  UpperBlocks& upper = batch_.matrix();
  if (!at.body->assemble(shift * shift, shift, 1, *at.held, clamp, upper)) {
    if (!matrix_ || generation_ != at.body->generation()) matrix_ = at.body->make_matrix();
    generation_ = at.body->generation();
    at.body->assemble(shift * shift, shift, 1, *at.held, clamp, *matrix_);
    upper.take(*matrix_);
    if (small_) return factor_.factorise(*matrix_);
  }
  batch_.prepare(*at.held, {at.coarse ? at.coarse->inverse(shift * shift, shift) : nullptr, at.pieces});
  return true;
}

bool ShiftedSolver::solve(const Linearisation& at, std::span<const SolveColumn> columns, double tolerance) {
  assert(tolerance > 0);
  assert(std::all_of(columns.begin(), columns.end(), [&](const SolveColumn& c) { return c.b->size() == at.masses().size(); }));
  bool definite = true;
  if (!small_) {
    iterations_ += batch_.solve(columns, tolerance, definite);
    return definite;
  }
  for (const SolveColumn& column : columns) {
    Vector b = *column.b;
    mask(*at.held, b);
    if (column.x->size() == b.size()) mask(*at.held, *column.x);
    const SolveStats stats = factor_.solve(b, tolerance, *column.x);
    iterations_ += stats.iterations;
    definite = definite && stats.positive_definite;
  }
  return definite;
}

std::optional<Matrix> krylov_basis(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve,
                                   const BasisRequest& request) {
  const Vector& masses = at.masses();
  assert(request.modes > 0 && masses.minCoeff() > 0);
  Orthonormal basis(masses, request.modes);
  for (const Vector& x : start.ports) basis.add(x);
  basis.add(at.free_velocity());
  for (const Vector& x : start.fine) basis.add(x);
  basis.add(start.residual);
  std::vector<Vector> moment = start.ports;
  moment.push_back(start.residual);
  if (start.motion.size() > 0) {
    basis.add(start.motion);
    moment.push_back(start.motion);
  }
  constexpr int kMomentsMax = 8;  // a guard: four fill kMaxModes unless they are dependent, each with at least four directions
  for (int m = 1; m < kMomentsMax && !basis.full(); ++m)
    for (std::size_t begin = 0; begin < moment.size() && !basis.full();) {
      // No more at once than there is room for.
      const std::size_t end = std::min(moment.size(), begin + static_cast<std::size_t>(basis.room()));
      const std::span<Vector> x(moment.begin() + static_cast<std::ptrdiff_t>(begin),
                                moment.begin() + static_cast<std::ptrdiff_t>(end));
      const std::vector<Vector> b = moment_inputs(at, request.shift_1_s, x);
      std::vector<SolveColumn> columns;
      for (std::size_t k = 0; k < x.size(); ++k)
        columns.push_back({&b[k], &x[k], begin + k < start.ports.size() ? 1 : kOwnToleranceFactor});
      if (!solve(columns)) return std::nullopt;
      for (const Vector& y : x) basis.add(y);
      begin = end;
    }
  return basis.take();
}

double softest_stiffness(const Dynamics& dynamics) {
  const auto& fixed = dynamics.body().fixed;
  if (std::find(fixed.begin(), fixed.end(), 1) == fixed.end()) return 0;
  const BodyState rest = dynamics.rest_state();
  WholeBody whole(dynamics, rest);
  Linearisation at(whole, fixed);
  at.coarse = whole.coarse();
  at.pieces = whole.pieces();
  ShiftedSolver solver(dynamics);
  if (!solver.prepare(at, 0, false)) return 0;
  constexpr int kInverseIterations = 12;      // each divides the quotient's error by (mu_2 / mu_1)^2
  constexpr double kInverseTolerance = 1e-3;  // of its solves: the quotient needs a few per cent, and its error is quadratic
  // Any start that is not orthogonal to the lowest mode: the distances of nodes from the origin, along all axes.
  Vector y = rest.x.array() + 1.0, x = Vector::Zero(y.size());
  for (int k = 0; k < kInverseIterations; ++k) {
    const Vector b = dynamics.masses().cwiseProduct(y);
    if (!solver.solve(at, b, kInverseTolerance, x)) return 0;
    y = x / x.norm();  // x is also the next first guess: near the end only its length is wrong
  }
  Vector k_y, d_y;
  dynamics.multiply_tangents(rest, y, k_y, d_y);
  return std::max(0.0, y.dot(k_y) / y.dot(dynamics.masses().cwiseProduct(y)));
}

}  // namespace palpate
