#include "server/body/settle.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/base/limits.hpp"
#include "server/body/linear_solver.hpp"

namespace palpate {
namespace {

constexpr double kFirstS = 0.05, kGrowth = 4, kShortestS = 1e-4, kLongestS = 1e6;
constexpr double kSolved = 1e-6;                    // of a step's right-hand side, where it is solved by iterations
constexpr std::uint32_t kDirectNodes = 6000;        // up to so many the matrix is factorised
constexpr int kIterationsMax = 300, kCutsMax = 12;  // of a step: halvings

class Search {
 public:
  Search(const Dynamics& dynamics, const BodyState& from)
      : dynamics_(&dynamics),
        solver_(dynamics.nodes(),
                dynamics.nodes() <= kDirectNodes ? LinearSolver::Method::direct : LinearSolver::Method::conjugate_gradients),
        matrix_(dynamics.make_matrix()) {
    found_.state = from;
    found_.state.v.setZero();
    found_.state.time_s = 0;
  }

  Equilibrium run() {
    energy_ = dynamics_->energy(found_.state);
    balance();
    for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) found_.load_n += at_node(f_, i).norm();
    while (found_.residual_n > kBalanced * found_.load_n && found_.iterations < kIterationsMax && h_s_ > kShortestS) {
      ++found_.iterations;
      if (!direction() || !descend()) h_s_ /= kGrowth;
    }
    found_.found = found_.residual_n <= kBalanced * found_.load_n;
    return found_;
  }

 private:
  const std::vector<std::uint8_t>& fixed() const { return dynamics_->body().fixed; }

  /// The forces where the body is, and the largest of them.
  void balance() {
    dynamics_->forces(found_.state, f_);
    mask(fixed(), f_);
    found_.residual_n = 0;
    for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) found_.residual_n = std::max(found_.residual_n, at_node(f_, i).norm());
  }

  /// dx; false where no matrix gives one.
  bool direction() {
    for (const bool clamp : {false, true}) {
      dynamics_->assemble(found_.state, 1 / (h_s_ * h_s_), 0, 1, fixed(), clamp, matrix_);
      dx_ = Vector::Zero(f_.size());
      if (!solver_.factorise(matrix_) || !solver_.solve(f_, kSolved, dx_).positive_definite) continue;
      if (dx_.allFinite() && dx_.dot(f_) > 0) return true;
    }
    return false;
  }

  /// As far along dx as the energy falls.
  bool descend() {
    constexpr double kEnough = 1e-4, kRounding = 1e-12;
    const BodyState from = found_.state;
    const double before = energy_, slope = f_.dot(dx_), residual_n = found_.residual_n;
    const Vector f = f_;
    double share = std::min(1.0, kWorldExtentM / std::max(dx_.cwiseAbs().maxCoeff(), 1e-300));
    for (int cut = 0; cut < kCutsMax; ++cut, share /= 2) {
      found_.state.x = from.x + share * dx_;
      energy_ = dynamics_->energy(found_.state);
      if (!(energy_ <= before - kEnough * share * slope + kRounding * (std::abs(before) + slope))) continue;
      balance();
      // Near the end the energy tells nothing any more: what is out of balance does.
      if (slope < kRounding * std::abs(before) && !(found_.residual_n < residual_n)) continue;
      if (cut == 0) h_s_ = std::min(h_s_ * kGrowth, kLongestS);
      return true;
    }
    found_.state = from;
    found_.residual_n = residual_n;
    energy_ = before;
    f_ = f;
    return false;
  }

  const Dynamics* dynamics_;
  LinearSolver solver_;
  BlockMatrix matrix_;
  Equilibrium found_;
  Vector f_, dx_;
  double h_s_ = kFirstS, energy_ = 0;
};

}  // namespace

Equilibrium find_equilibrium(const Dynamics& dynamics) {
  if (dynamics.body().gravity_m_s2.squaredNorm() == 0) return {dynamics.rest_state(), 0, 0, 0, true};
  return find_equilibrium(dynamics, dynamics.rest_state());
}

Equilibrium find_equilibrium(const Dynamics& dynamics, const BodyState& from) {
  if (dynamics.relaxation().empty()) return Search(dynamics, from).run();
  LumpedBody relaxed = dynamics.body();
  relaxed.relaxation.clear();
  for (SolidMaterial& material : relaxed.materials) material.young_pa *= dynamics.relaxation().left();
  const Dynamics slow(relaxed);
  Equilibrium equilibrium = Search(slow, {from.time_s, from.x, from.v, nullptr}).run();
  dynamics.relaxation().relax_fully(equilibrium.state);
  return equilibrium;
}

BodyState settled_state(const Dynamics& dynamics) {
  Equilibrium equilibrium = find_equilibrium(dynamics);
  if (!equilibrium.found)
    throw std::runtime_error("the body finds no equilibrium in gravity: it is too soft, or not fixed anywhere");
  return std::move(equilibrium.state);
}

}  // namespace palpate
