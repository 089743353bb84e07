#include "bench/tissue/boundary_problem.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace palpate {
namespace {

constexpr double kLeft = 1e-8;      // allowed residual force at the end, as a share of the loads
constexpr double kSolvedTo = 1e-9;  // relative tolerance of iterative solves
constexpr std::uint32_t kFactorised = 8000;
constexpr int kNewtonMax = 40, kShareHalvings = 6, kCuts = 10;

}  // namespace

BoundaryProblem::BoundaryProblem(const LumpedBody& body)
    : dynamics_(body),
      solver_(dynamics_.nodes(),
              dynamics_.nodes() <= kFactorised ? LinearSolver::Method::direct : LinearSolver::Method::conjugate_gradients),
      matrix_(dynamics_.make_matrix()),
      state_(dynamics_.rest_state()),
      held_(3 * std::size_t{dynamics_.nodes()}, 0),
      none_(dynamics_.nodes(), 0) {
  target_ = asked_load_ = applied_ = Vector::Zero(state_.x.size());
  for (std::uint32_t i = 0; i < dynamics_.nodes(); ++i)
    if (body.fixed[i]) hold(i, Vec3::Zero());
}

void BoundaryProblem::hold(std::uint32_t node, int axis, double displacement_m) {
  held_[component(node, axis)] = 1;
  at_node(target_, node)[axis] = displacement_m;
}

void BoundaryProblem::hold(std::uint32_t node, const Vec3& displacement_m) {
  for (int axis = 0; axis < 3; ++axis) hold(node, axis, displacement_m[axis]);
}

void BoundaryProblem::release(std::uint32_t node, int axis) { held_[component(node, axis)] = 0; }

void BoundaryProblem::push(std::uint32_t node, const Vec3& force_n) { at_node(asked_load_, node) += force_n; }

void BoundaryProblem::solve(int shares) {
  Vector u0(target_.size());
  for (std::uint32_t i = 0; i < dynamics_.nodes(); ++i) at_node(u0, i) = displacement(i);
  const Vector p0 = applied_;
  for (int k = 0; k < shares; ++k) {
    const double from = double(k) / shares, to = double(k + 1) / shares;
    if (!advance(u0 + from * (target_ - u0), p0 + from * (asked_load_ - p0), u0 + to * (target_ - u0),
                 p0 + to * (asked_load_ - p0), kShareHalvings))
      throw std::runtime_error(
          fmt::format("no equilibrium was found: {:.3g} N of {:.3g} N are out of balance", out_of_balance(), load()));
  }
}

bool BoundaryProblem::advance(const Vector& u0, const Vector& p0, const Vector& u1, const Vector& p1, int halvings) {
  const Vector x = state_.x, p = applied_;
  if (newton(u1, p1)) return true;
  if (halvings == 0) return false;
  state_.x = x;
  applied_ = p;
  const Vector u = (u0 + u1) / 2, load = (p0 + p1) / 2;
  return advance(u0, p0, u, load, halvings - 1) && advance(u, load, u1, p1, halvings - 1);
}

bool BoundaryProblem::newton(const Vector& u, const Vector& p) {
  applied_ = p;
  Vector change = Vector::Zero(u.size());
  for (std::uint32_t i = 0; i < dynamics_.nodes(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (holds(i, axis)) at_node(change, i)[axis] = at_node(u, i)[axis] - displacement(i)[axis];
  take_residual();
  if (!step(change, false) && !step(change, true)) return false;
  state_.x += step_;
  take_residual();
  change.setZero();
  for (int k = 0; k < kNewtonMax; ++k) {
    if (!residual_.allFinite()) return false;
    if (out_of_balance() <= kLeft * load()) return true;
    if (!(step(change, false) && descend()) && !(step(change, true) && descend())) return false;
  }
  return false;
}

bool BoundaryProblem::step(const Vector& held_change, bool clamp) {
  dynamics_.assemble(state_, 0, 0, 1, none_, clamp, matrix_);
  matrix_.multiply(held_change, right_);
  right_ = residual_ - right_;
  for (std::size_t c = 0; c < held_.size(); ++c)
    if (held_[c]) right_[static_cast<Eigen::Index>(c)] = held_change[static_cast<Eigen::Index>(c)];
  mask_matrix();
  step_ = Vector::Zero(right_.size());
  return solver_.factorise(matrix_) && solver_.solve(right_, kSolvedTo, step_).positive_definite && step_.allFinite();
}

bool BoundaryProblem::descend() {
  constexpr double kRounding = 1e-11;
  const Vector from = state_.x, before_residual = residual_;
  const double before = potential(), left = out_of_balance();
  double slope = 0;
  for (std::size_t c = 0; c < held_.size(); ++c)
    if (!held_[c]) slope += residual_[static_cast<Eigen::Index>(c)] * step_[static_cast<Eigen::Index>(c)];
  if (!(slope > 0)) return false;
  double share = 1;
  for (int cut = 0; cut < kCuts; ++cut, share /= 2) {
    state_.x = from + share * step_;
    take_residual();
    // Near the end the energy no longer discriminates, but the residual force does.
    if (residual_.allFinite() && (out_of_balance() < left / 2 || potential() <= before - 1e-4 * share * slope)) return true;
    if (slope < kRounding * std::abs(before) && out_of_balance() < left) return true;
  }
  state_.x = from;
  residual_ = before_residual;
  return false;
}

void BoundaryProblem::take_residual() {
  dynamics_.forces(state_.x, state_.v, residual_);
  residual_ += applied_;
}

void BoundaryProblem::mask_matrix() {
  for (std::uint32_t row = 0; row < matrix_.rows(); ++row)
    for (std::uint32_t e = matrix_.row_begin(row); e < matrix_.row_end(row); ++e) {
      const std::uint32_t column = matrix_.column(e);
      auto block = matrix_.block(e);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          if (holds(row, i) || holds(column, j)) block(i, j) = row == column && i == j ? 1 : 0;
    }
}

double BoundaryProblem::out_of_balance() const {
  double most = 0;
  for (std::size_t c = 0; c < held_.size(); ++c)
    if (!held_[c]) most = std::max(most, std::abs(residual_[static_cast<Eigen::Index>(c)]));
  return most;
}

double BoundaryProblem::load() const {
  double sum = applied_.cwiseAbs().sum();
  for (std::size_t c = 0; c < held_.size(); ++c)
    if (held_[c]) sum += std::abs(residual_[static_cast<Eigen::Index>(c)]);
  return sum;
}

double BoundaryProblem::potential() const { return dynamics_.energy(state_) - applied_.dot(state_.x); }

}  // namespace palpate
