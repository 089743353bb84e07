#include "server/reduce/basis.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

/// Grows an M-orthonormal basis a vector at a time.
class Orthonormal {
 public:
  Orthonormal(const Vector& masses, int columns) : masses_(masses), v_(masses.size(), columns) {}

  bool full() const { return count_ == v_.cols(); }
  void add(Vector y) {
    if (full()) return;
    const double before = norm(y);
    if (!(before > 0) || !std::isfinite(before)) return;
    for (int pass = 0; pass < 2; ++pass)
      for (Eigen::Index k = 0; k < count_; ++k) y -= v_.col(k).dot(masses_.cwiseProduct(y)) * v_.col(k);
    const double after = norm(y);
    constexpr double kDependent = 1e-5;
    if (after > kDependent * before) v_.col(count_++) = y / after;
  }
  Matrix take() const { return v_.leftCols(count_); }

 private:
  double norm(const Vector& y) const { return std::sqrt(y.dot(masses_.cwiseProduct(y))); }
  const Vector& masses_;
  Matrix v_;
  Eigen::Index count_ = 0;
};

}  // namespace

bool ShiftedSolver::prepare(const Linearisation& at, double shift, bool clamp) {
  iterations_ = 0;
  at.dynamics->assemble(*at.state, shift * shift, shift, 1, *at.held, clamp, matrix_);
  return solver_.factorise(matrix_);
}

bool ShiftedSolver::solve(const Linearisation& at, Vector b, double tolerance, Vector& x) {
  mask(*at.held, b);
  if (x.size() == b.size()) mask(*at.held, x);
  const SolveStats stats = solver_.solve(b, tolerance, x);
  iterations_ += stats.iterations;
  return stats.positive_definite;
}

std::optional<Matrix> krylov_basis(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve,
                                   const BasisRequest& request) {
  const Vector& masses = at.dynamics->masses();
  Orthonormal basis(masses, request.modes);
  Vector free_motion = at.state->v;
  mask(*at.held, free_motion);
  for (const Vector& x : start.ports) basis.add(x);
  basis.add(free_motion);
  for (const Vector& x : start.fine) basis.add(x);
  for (const Vector& x : start.loads) basis.add(x);
  basis.add(start.imbalance);
  basis.add(start.motion);

  std::vector<Vector> moment = start.ports;
  moment.push_back(start.imbalance);
  moment.push_back(start.motion);
  constexpr int kMomentsMax = 8;
  for (int m = 1; m < kMomentsMax && !basis.full(); ++m)
    for (Vector& x : moment) {
      if (basis.full()) break;
      Vector k_x, d_x;
      at.dynamics->multiply_tangents(*at.state, x, k_x, d_x);
      const Vector b = 2 * request.shift_1_s * masses.cwiseProduct(x) + d_x;
      if (!solve(b, x)) return std::nullopt;
      basis.add(x);
    }
  return basis.take();
}

std::optional<Matrix> krylov_basis(const Linearisation& at, ShiftedSolver& solver, const std::vector<Vector>& ports,
                                   const std::vector<Vector>& fine, const Vector& imbalance, const BasisRequest& request,
                                   BasisMemory& memory) {
  std::size_t solves = 0;
  const KrylovSolve solve = [&](const Vector& b, Vector& x) {
    if (memory.size() <= solves) memory.emplace_back(Vector::Zero(b.size()));
    Vector& kept = memory[solves++];
    if (!solver.solve(at, b, request.tolerance, kept)) return false;
    x = kept;
    return true;
  };
  Vector motion = at.state->v;
  mask(*at.held, motion);
  KrylovStart start{{}, fine, {}, {}, {}};
  start.ports.resize(ports.size());
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (!solve(ports[k], start.ports[k])) return std::nullopt;
  if (!solve(imbalance, start.imbalance) || !solve(at.dynamics->masses().cwiseProduct(motion), start.motion)) return std::nullopt;
  return krylov_basis(at, start, solve, request);
}

double softest_stiffness(const Dynamics& dynamics) {
  const auto& fixed = dynamics.body().fixed;
  if (std::find(fixed.begin(), fixed.end(), 1) == fixed.end()) return 0;
  const BodyState rest = dynamics.rest_state();
  const Linearisation at{&dynamics, &rest, &fixed};
  ShiftedSolver solver(dynamics);
  if (!solver.prepare(at, 0, false)) return 0;
  constexpr int kIterations = 12;
  constexpr double kTolerance = 1e-3;
  // Any start that is not orthogonal to the lowest mode: how far a node is from the origin, along all axes.
  Vector y = rest.x.array() + 1.0, x = Vector::Zero(y.size());
  for (int k = 0; k < kIterations; ++k) {
    const Vector b = dynamics.masses().cwiseProduct(y);
    if (!solver.solve(at, b, kTolerance, x)) return 0;
    y = x / x.norm();
    x.setZero();
  }
  Vector k_y, d_y;
  dynamics.multiply_tangents(rest, y, k_y, d_y);
  return std::max(0.0, y.dot(k_y) / y.dot(dynamics.masses().cwiseProduct(y)));
}

}  // namespace palpate
