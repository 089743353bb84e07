#include "server/body/settle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "server/solve/linear_solver.hpp"

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
    while (!is_balanced() && found_.iterations < kIterationsMax && h_s_ > kShortestS) {
      ++found_.iterations;
      if (!direction() || !descend()) h_s_ /= kGrowth;
    }
    found_.found = is_balanced();
    return found_;
  }

 private:
  const std::vector<std::uint8_t>& fixed() const { return dynamics_->body().fixed; }
  bool is_balanced() const { return found_.residual_n <= std::max(kBalanced * found_.load_n, rounding_n_); }

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
      take_rounding();
      dx_ = Vector::Zero(f_.size());
      if (!solver_.factorise(matrix_) || !solver_.solve(f_, kSolved, dx_).positive_definite) continue;
      if (dx_.allFinite() && dx_.dot(f_) > 0) return true;
    }
    return false;
  }

  /// Of the energy and of the force on a node, from the stiffness of the nodes that are not fixed.
  void take_rounding() {
    constexpr double kOfEnergy = 1e-15, kOfForces = 1e-15;
    double all = 0, most = 0;
    for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
      if (fixed()[i]) continue;
      const double stiffness = matrix_.block(matrix_.diagonal(i)).trace() / 3 - dynamics_->body().masses_kg[i] / (h_s_ * h_s_);
      all += std::abs(stiffness);
      most = std::max(most, std::abs(stiffness));
    }
    rounding_j_ = kOfEnergy * all * edge_m_ * edge_m_;
    rounding_n_ = kOfForces * most * found_.state.x.cwiseAbs().maxCoeff();
  }

  /// As far along dx as the energy falls; where bodies meet or threads slide, whose forces are not quite those of a potential, or
  /// the force.
  bool descend() {
    constexpr double kEnough = 1e-4, kRounding = 1e-12, kNearer = 0.9;
    const BodyState from = found_.state;
    const double before = energy_, slope = f_.dot(dx_), residual_n = found_.residual_n;
    const double rounding_j = kRounding * std::abs(before) + rounding_j_;
    const Vector f = f_;
    double share = std::min(1.0, kWorldExtentM / std::max(dx_.cwiseAbs().maxCoeff(), 1e-300));
    for (int cut = 0; cut < kCutsMax; ++cut, share /= 2) {
      found_.state.x = from.x + share * dx_;
      energy_ = dynamics_->energy(found_.state);
      const bool falls = energy_ <= before - kEnough * share * slope + kRounding * slope + rounding_j;
      if (!falls && !meets_) continue;
      balance();
      if (falls ? slope < rounding_j && !(found_.residual_n < residual_n) : !(found_.residual_n < kNearer * residual_n)) continue;
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
  bool meets_ = !dynamics_->body().members.empty() || !dynamics_->sutures().empty();
  double edge_m_ = mean_edge_m(dynamics_->body());
  double h_s_ = kFirstS, energy_ = 0, rounding_j_ = 0, rounding_n_ = 0;
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
  Equilibrium equilibrium = Search(slow, {.time_s = from.time_s, .x = from.x, .v = from.v, .sutures = from.sutures}).run();
  dynamics.relaxation().relax_fully(equilibrium.state);
  return equilibrium;
}

BodyState settled_state(const Dynamics& dynamics, const std::string& scene) {
  Equilibrium equilibrium = find_equilibrium(dynamics);
  if (!equilibrium.found)
    throw InputError("scene \"" + scene + "\": body.gravity_m_s2",
                     fmt::format("lets the body find no equilibrium: after {} steps {:.3g} N of {:.3g} N are out of balance",
                                 equilibrium.iterations, equilibrium.residual_n, equilibrium.load_n),
                     "a body that is fixed somewhere and stiff enough for its weight");
  return std::move(equilibrium.state);
}

}  // namespace palpate
