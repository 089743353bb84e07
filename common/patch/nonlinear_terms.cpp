#include "common/patch/nonlinear_terms.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <optional>

namespace palpate {
namespace {

constexpr double kShiftShare = 1e-6;  // share of the mean diagonal: above the rounding of numbers sent in single precision, 6e-8

/// Returns alpha of dampers with the force g, without which the rates at the end are `at_end`; nothing where they do not damp.
/// `closing`: for the modes, the last.
std::optional<double> share_at_end(const NonlinearForce::Variables& g, const NonlinearForce::Variables& rate,
                                   const NonlinearForce::Variables& at_end, const ModeMatrix& closing) {
  const auto r = closing.rows();
  const double power = rate.dot(g), taken = g.tail(r).dot(closing * g.tail(r));
  if (!(power > 0) || !(taken >= 0)) return {};
  return at_end.dot(g) / (power + taken);
}

}  // namespace

bool has_room(const PortSurface& surface, const NonlinearTerms& terms) {
  return surface.vertex_count + static_cast<int>(terms.vertices.size()) <= kMaxPortVertices &&
         surface.triangle_count + static_cast<int>(terms.triangles.size()) <= kMaxPortTriangles;
}

Patch extended(Patch patch, const NonlinearTerms& terms) {
  assert(has_room(patch.surface, terms));
  PortSurface& surface = patch.surface;
  std::copy(terms.vertices.begin(), terms.vertices.end(), surface.vertices.begin() + surface.vertex_count);
  std::copy(terms.triangles.begin(), terms.triangles.end(), surface.triangles.begin() + surface.triangle_count);
  surface.vertex_count += static_cast<int>(terms.vertices.size());
  surface.triangle_count += static_cast<int>(terms.triangles.size());
  return patch;
}

Eigen::MatrixXd joint_stiffness(const Patch& patch, const Eigen::VectorXd& stiffness) {
  assert(stiffness.size() == patch.modes());
  const Eigen::Index first = patch.contact == ContactKind::attach ? 3 : 0, r = stiffness.size();
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(first + r, first + r);
  h.bottomRightCorner(r, r).diagonal() = stiffness;
  if (first > 0) h.topLeftCorner<3, 3>() = patch.k_port;
  if (first > 0 && r > 0) {
    h.bottomLeftCorner(r, 3) = -patch.b_k;
    h.topRightCorner(3, r) = -patch.b_k.transpose();
  }
  return h;
}

Eigen::MatrixXd joint_damping(const Patch& patch) {
  const Eigen::Index first = patch.contact == ContactKind::attach ? 3 : 0, r = patch.modes();
  Eigen::MatrixXd d(first + r, first + r);
  d.bottomRightCorner(r, r) = patch.damping;
  if (first > 0) {
    d.topLeftCorner<3, 3>() = patch.d_port;
    d.bottomLeftCorner(r, 3) = -patch.b_d;
    d.topRightCorner(3, r) = -patch.b_d.transpose();
  }
  return d;
}

void NonlinearForce::take_e2(const NonlinearTerms& terms, const Patch& patch) {
  const int n = variables_;
  assert(terms.e2.size() == pairs_of(n));
  e2_.resize(n, n);
  for (int p = 0; p < n; ++p)
    for (int i = 0; i < n; ++i) e2_(p, i) = (p == i ? 2.0F : 1.0F) * terms.e2[pair_at(std::min(p, i), std::max(p, i))];
  Eigen::MatrixXd far = joint_stiffness(patch, patch.stiffness) + e2_.cast<double>();
  if (const auto* const springs = std::get_if<SampledSpringForce>(&sampled_)) far += springs->far_stiffness();
  far.diagonal().array() += kShiftShare * far.trace() / n;  // a tool that moves across a planar body meets no stiffness
  has_e2_ = Eigen::LLT<Eigen::MatrixXd>(far).info() == Eigen::Success;
}

NonlinearForce::NonlinearForce(const NonlinearTerms& terms, const Patch& patch) {
  constexpr double kTouchDampingMin = 20;  // |D| times a step, below which S is of no use to a touch (docs/notebook.md, 38)
  if (terms.elements.count() == 0) return;
  steps_ = terms.grasp ? kGraspSteps : kTouchSteps;
  bool stable = take_elements(terms, false);
  if (!stable) {
    if (!terms.elements.is_solid()) steps_ *= 2;
    stable = take_elements(terms, true);
  }
  if (!stable) {
    steps_ = 1;
    return;
  }
  const int n = variables_ = terms.variables;
  assert(n == patch.modes() + (terms.grasp ? 3 : 0) && terms.grasp == (patch.contact == ContactKind::attach));
  if (terms.e2.size() > 0) take_e2(terms, patch);
  Eigen::MatrixXd d = joint_damping(patch);
  d.diagonal().array() += kShiftShare * d.trace() / n;
  const Eigen::LLT<Eigen::MatrixXd> factor(d);
  has_damping_ = factor.info() == Eigen::Success && d.trace() > 0;
  root_ = Eigen::MatrixXd(factor.matrixU()).cast<float>();
  inverse_ = factor.matrixL().solve(Eigen::MatrixXd::Identity(n, n)).cast<float>();
  const auto* const solid = std::get_if<SampledSolidForce>(&sampled_);
  const bool brakes = terms.grasp || patch.damping.norm() > kTouchDampingMin * kHapticRateHz * steps_;
  if (solid != nullptr && brakes) lagged_damping_ = LaggedDamping(*solid, patch.damping);
}

const ModeMatrix& NonlinearForce::added_mass() const {
  return of_sampled([](const auto& s) -> const ModeMatrix& { return s.added_mass(); });
}

bool NonlinearForce::take_elements(const NonlinearTerms& terms, bool slowed) {
  const int tool = terms.grasp ? 3 : 0;
  const double step_s = 1.0 / (kHapticRateHz * steps_);
  if (terms.elements.is_solid())
    sampled_.emplace<SampledSolidForce>(terms.elements, tool, step_s, slowed);
  else
    sampled_.emplace<SampledSpringForce>(terms.elements, tool, terms.rate, step_s, slowed);
  return of_sampled([](const auto& s) { return !s.empty(); });
}

void NonlinearForce::move_to(const Variables& u) noexcept {
  assert(u.size() == variables_);
  u_ = u.cast<float>();
  std::visit([&](auto& s) { s.move_to(u_); }, sampled_);
}

void NonlinearForce::elastic(Variables& force) const noexcept {
  Values g(variables_);
  of_sampled([&](const auto& s) { s.gradient(g); });
  if (has_e2_) g.noalias() += e2_ * u_;
  force = -g.cast<double>();
}

void NonlinearForce::damping(const Variables& u_rate, const ModeMatrix& closing, const Variables& before,
                             Variables& force) noexcept {
  force.setZero(u_rate.size());
  if (!has_damping_) return;
  assert(u_rate.size() == variables_ && before.size() == variables_ && closing.rows() <= variables_);
  const Values rate = u_rate.cast<float>();
  Values change(variables_), at_stamp(variables_);
  of_sampled([&](const auto& s) { s.damping(rate, change, at_stamp); });
  const float most = kDamperShareMax * (root_ * rate).norm();
  if (!lagged_damping_.empty()) {
    brake_at_end(change.cast<double>(), u_rate, closing, before, most, force);
    since_asked_ = (since_asked_ + 1) % steps_;
    if (since_asked_ == 0) lagged_damping_.renew(std::get<SampledSolidForce>(sampled_), closing);
    return;
  }
  force = -(change - at_stamp).cast<double>();
  const float size = (inverse_ * change).norm();
  if (!(size > most)) return;
  Variables at_end = u_rate;
  at_end.tail(closing.rows()) += closing * (at_stamp.cast<double>() - before).tail(closing.rows());
  force *= share_at_end(change.cast<double>(), u_rate, at_end, closing).value_or(static_cast<double>(most / size));
}

void NonlinearForce::brake_at_end(const Variables& change, const Variables& u_rate, const ModeMatrix& closing,
                                  const Variables& before, float most, Variables& force) const noexcept {
  const auto r = closing.rows();
  const LaggedDamping::ForVariables& s = lagged_damping_.change();
  const ModeMatrix& closing_held = lagged_damping_.closing().size() > 0 ? lagged_damping_.closing() : closing;
  const Variables held = s * u_rate, g = change - held;
  const ModeVector carried = closing * before.tail(r);
  ModeVector push = s.bottomRightCorner(r, r) * carried - held.tail(r);
  const float size = (inverse_ * g.cast<float>()).norm();
  double part = 1;
  if (size > most) {
    Variables at_end = u_rate;
    at_end.tail(r) += closing_held * push - carried;
    part = share_at_end(g, u_rate, at_end, closing_held).value_or(static_cast<double>(most / size));
  }
  push -= part * g.tail(r);
  const ModeVector slowed = closing_held * push - carried;  // change of the modes' rates
  force.noalias() = -held - part * g - s.rightCols(r) * slowed;
}

double NonlinearForce::energy() const noexcept {
  const double energy = of_sampled([](const auto& s) { return s.energy(); });
  return has_e2_ ? energy + static_cast<double>(u_.dot(e2_ * u_) / 2) : energy;
}

}  // namespace palpate
