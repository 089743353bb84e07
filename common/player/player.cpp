#include "common/player/player.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

constexpr std::int64_t kTicksMax = 2 * kSampleHistoryTicks;  // largest advance(); a longer gap than any history ends there

}  // namespace

PatchPlayer::PatchPlayer(const Patch& patch, const NonlinearTerms& terms)
    : patch_(extended(patch, terms)), nonlinear_(terms, patch) {
  const auto r = patch.modes();
  const auto of_step = [&] {
    steps_ = nonlinear_.steps();
    assert(steps_ >= 1);
    dt_ = 1.0 / (kHapticRateHz * steps_);
    return make_propagator(patch.stiffness, patch.damping, nonlinear_.added_mass(), dt_);
  };
  Propagator p = of_step();
  z_ = StateVector::Zero(2 * r);
  if (r > 0) {
    z_.tail(r) = patch.q_rate;
    if (!nonlinear_.empty()) {
      const ModeMatrix reach = p.phi.topRightCorner(r, r);
      closing_ = p.psi0.bottomRows(r) - p.phi.bottomRightCorner(r, r) * reach.partialPivLu().solve(ModeMatrix(p.psi0.topRows(r)));
      // H, dt / 2 for slow modes; larger than dt for a mode with a period below 2.7 steps
      if (!(closing_.cwiseAbs().maxCoeff() < dt_)) {
        nonlinear_ = {};  // only the linear patch
        p = of_step();
      }
    }
    psi0_ = p.psi0;
    drift_ = p.psi0 * patch.g;
    if (patch.load_rate.size() > 0) {
      // A step in which the load ends counts as a whole: an error of half a step in a load of tens of steps.
      const ModeVector growth = dt_ * patch.load_rate;
      drift_growth_ = p.psi0 * growth;
      load_steps_ = steps_ * ((patch.load_for + kTick / 2) / kTick);
      ramp_ = p.psi1 * growth;
      if (load_steps_ > 0) drift_ += ramp_;
    }
    if (patch.contact == ContactKind::attach) {
      transition_.resize(2 * r, 2 * r + 9);
      transition_.leftCols(2 * r) = p.phi;
      transition_.middleCols(2 * r, 3) = (p.psi0 - p.psi1) * patch.b_k;
      transition_.middleCols(2 * r + 3, 3) = p.psi1 * patch.b_k;
      transition_.rightCols(3) = p.psi0 * patch.b_d;
      felt_.resize(3, 2 * r);
      felt_ << patch.b_k.transpose(), patch.b_d.transpose();
    } else {
      transition_ = p.phi;
    }
  }
  const auto vertices = static_cast<std::size_t>(patch_.surface.vertex_count);
  const auto triangles = static_cast<std::size_t>(patch_.surface.triangle_count);
  connect_surface({patch_.surface.triangles.data(), triangles}, vertices, {first_.data(), vertices + 1},
                  {incident_.data(), 3 * triangles}, {open_.data(), triangles});
  rest_.resize(static_cast<Eigen::Index>(3 * vertices));
  rows_.resize(rest_.size(), r);
  for (std::size_t i = 0; i < vertices; ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    rest_.segment<3>(at) = patch_.surface.vertices[i].position;
    if (r > 0) rows_.middleRows<3>(at) = patch_.surface.vertices[i].rows;
  }
  if (patch.contact == ContactKind::touch && r > 0) responses_ = psi0_ * rows_.transpose();
  vertices_ = rest_;
  lean_.fill(Vec3::Zero());
  for (std::uint32_t i = 0; i < vertices; ++i) {
    const Vec3& normal = patch_.surface.vertices[i].normal;
    if (normal.squaredNorm() > 0) lean_[i] = normal - vertex_normal(surface(), positions(), i);
  }
  touching_ = patch.touching && !patch.needle.tip.inside;
  point_ = patch.point;
  carried_ = StateVector::Zero(2 * r);
  if (patch.contact == ContactKind::touch) {
    others_ = OtherContacts(patch, psi0_, dt_);
    needle_ = NeedleContacts(patch, psi0_);
    if (touching_ && r > 0) {
      update_response();
      push_ = -patch.force;
      for (int j = 0; j < patch.others.own; ++j) push_ -= others_.push(j);
      carried_.noalias() = share_before_ * (response_ * push_);
    }
  }
  time_ = patch.stamp;
  tool_ = {patch.tool, patch.turn.value_or(Rotation::Identity())};
  if (patch.contact == ContactKind::touch && triangles > 0)
    separate(tool_.centre_of(patch.sphere) - position_at(surface(), positions(), point_));
  output_ = {patch.force, patch.touching, patch.torque};
  elastic_ = viscous_ = NonlinearForce::Variables::Zero(patch.contact == ContactKind::attach ? r + 3 : r);
  if (patch.fading.count > 0 && r > 0) {
    fading_ = NonlinearForce::Variables::Zero(elastic_.size());
    for (std::size_t k = 0; k < patch.fading.branches().size(); ++k) {
      const PatchBranch& branch = patch.fading.of[k];
      stays_[k] = std::exp(-dt_ / branch.prony.time_s);
      faded_[k] = (1 - std::sqrt(stays_[k])) * branch.pull;
      fading_ += branch.prony.share * faded_[k];
    }
  }
  bend(Vec3::Zero(), patch.tool_velocity);
}

PlayerOutput PatchPlayer::advance(const ToolSample& sample) noexcept {
  const std::int64_t half = kTick.count() / 2;
  const std::int64_t ticks = std::min((sample.t.count() - time_.count() + half) / kTick.count(), kTicksMax);
  if (ticks <= 0) return output_;
  const std::int64_t steps = ticks * steps_;
  const ToolPose from = tool_, to = patch_.turn ? ToolPose(sample) : ToolPose(sample.position);
  for (std::int64_t k = 1; k <= steps; ++k) {
    const double part = static_cast<double>(k) / static_cast<double>(steps);
    if (k == steps)
      step(to);
    else
      step(patch_.turn ? pose_between(from, to, part) : ToolPose(from.position + part * (to.position - from.position)));
  }
  time_ = sample.t;
  return output_;
}

void PatchPlayer::grow_load() noexcept {
  drift_ += drift_growth_;
  if (--load_steps_ == 0) drift_ -= ramp_;
}

void PatchPlayer::step(const ToolPose& tool) noexcept {
  if (!patch_.constant && patch_.contact == ContactKind::attach) step_attach(tool.position);
  if (!patch_.constant && patch_.contact == ContactKind::touch) step_touch(tool);
  if (load_steps_ > 0) grow_load();
  tool_ = tool;
}

void PatchPlayer::step_attach(const Vec3& tool) noexcept {
  const auto r = patch_.modes();
  const Vec3 d = tool_.position - patch_.tool, d_next = tool - patch_.tool;
  const Vec3 rate = (tool - tool_.position) / dt_ - patch_.tool_velocity;
  Vec3 force = patch_.force - patch_.k_port * d_next - patch_.d_port * rate;
  if (r > 0) {
    StepVector u(2 * r + 9);
    u.head(2 * r) = z_;
    u.segment<3>(2 * r) = d;
    u.segment<3>(2 * r + 3) = d_next;
    u.tail<3>() = rate;
    StateVector next = drift_;
    if (has_forces()) next.noalias() += psi0_ * forces().tail(r);
    next.noalias() += transition_ * u;
    z_ = next;
    bend(d_next, (tool - tool_.position) / dt_);
    const Vec3 half_before = fading_.size() > 0 ? Vec3(fading_.head<3>()) : Vec3::Zero();
    fade(d_next);
    force.noalias() += felt_ * z_;
    force.noalias() -= patch_.b_d.transpose() * patch_.q_rate;
    if (!nonlinear_.empty()) force += elastic_.head<3>() + viscous_.head<3>();
    if (fading_.size() > 0) force += 0.5 * (half_before + fading_.head<3>());
  }
  output_ = {force, true};
}

void PatchPlayer::bend(const Vec3& displacement, const Vec3& velocity) noexcept {
  if (nonlinear_.empty()) return;
  const auto r = patch_.modes();
  NonlinearForce::Variables u(r), rate(r);
  if (patch_.contact == ContactKind::attach) {
    u.resize(r + 3);
    rate.resize(r + 3);
    u.head<3>() = displacement;
    rate.head<3>() = velocity;
  }
  u.tail(r) = z_.head(r);
  NonlinearForce::Variables elastic(u.size()), viscous(u.size());
  nonlinear_.move_to(u);
  nonlinear_.elastic(elastic);
  rate.tail(r) = z_.tail(r) + closing_ * (elastic - elastic_).tail(r);
  nonlinear_.damping(rate, closing_, viscous_, viscous);
  if (elastic.allFinite() && viscous.allFinite()) {
    z_.tail(r) = rate.tail(r) + closing_ * (viscous - viscous_).tail(r);
    elastic_ = elastic;
    viscous_ = viscous;
  } else {
    nonlinear_ = {};  // whatever was received: the linear patch continues
    elastic_.setZero();
    viscous_.setZero();
  }
}

NonlinearForce::Variables PatchPlayer::forces() const noexcept {
  NonlinearForce::Variables sum = elastic_ + viscous_;
  if (fading_.size() > 0) sum += fading_;
  return sum;
}

void PatchPlayer::fade(const Vec3& displacement) noexcept {
  if (fading_.size() == 0) return;
  const auto r = patch_.modes();
  NonlinearForce::Variables bent = -elastic_;  // H u - f
  bent.tail(r) += patch_.stiffness.cwiseProduct(z_.head(r));
  if (patch_.contact == ContactKind::attach) {
    bent.tail(r).noalias() -= patch_.b_k * displacement;
    bent.head<3>().noalias() += patch_.k_port * displacement;
    bent.head<3>().noalias() -= patch_.b_k.transpose() * z_.head(r);
  }
  fading_.setZero();
  for (std::size_t k = 0; k < patch_.fading.branches().size(); ++k) {
    const PatchBranch& branch = patch_.fading.of[k];
    faded_[k] = stays_[k] * faded_[k] + (1 - stays_[k]) * (branch.pull + bent);
    fading_ += branch.prony.share * faded_[k];
  }
}

SurfaceView PatchPlayer::surface() const noexcept {
  const auto vertices = static_cast<std::size_t>(patch_.surface.vertex_count);
  const auto triangles = static_cast<std::size_t>(patch_.surface.triangle_count);
  return {{patch_.surface.triangles.data(), triangles},
          {first_.data(), vertices + 1},
          {incident_.data(), 3 * triangles},
          {open_.data(), triangles},
          {lean_.data(), vertices}};
}

Positions PatchPlayer::positions() const noexcept { return {vertices_.data(), static_cast<std::size_t>(vertices_.size())}; }

void PatchPlayer::place_vertices() noexcept {
  vertices_ = rest_;
  if (patch_.modes() > 0) vertices_.noalias() += rows_ * z_.head(patch_.modes());
}

PortRows PatchPlayer::rows_at(const SurfacePoint& point) const noexcept {
  assert(point.triangle < static_cast<std::uint32_t>(patch_.surface.triangle_count));
  const Triangle& corners = patch_.surface.triangles[point.triangle];
  PortRows rows = point.weight[0] * rows_.middleRows<3>(3 * corners[0]);
  for (std::size_t k = 1; k < 3; ++k) rows += point.weight[static_cast<int>(k)] * rows_.middleRows<3>(3 * corners[k]);
  return rows;
}

void PatchPlayer::update_response() noexcept {
  has_response_ = true;
  compliance_ = patch_.c_static;
  const auto r = patch_.modes();
  if (r == 0) return;
  const PortRows rows = rows_at(point_);
  const Triangle& corners = patch_.surface.triangles[point_.triangle];
  response_ = point_.weight[0] * responses_.middleCols<3>(3 * corners[0]);
  for (std::size_t k = 1; k < 3; ++k) response_ += point_.weight[static_cast<int>(k)] * responses_.middleCols<3>(3 * corners[k]);
  const Mat3 moved = rows * response_.topRows(r);
  share_before_ = share_of_next_step(patch_.contact_stiffness_n_m, moved);
  compliance_ += (1 - share_before_) * moved;
}

void PatchPlayer::step_touch(const ToolPose& tool) noexcept {
  const auto r = patch_.modes();
  if (r > 0) {
    StateVector next = drift_ + carried_;
    if (has_forces()) next.noalias() += psi0_ * forces().tail(r);
    next.noalias() += transition_ * z_;
    if (!others_.empty()) others_.carry_on(next);
    if (!needle_.empty()) needle_.carry_on(next);
    z_ = next;
    carried_.setZero();
  }
  close_others(tool);
  output_ = {};
  if (needle_.inside()) {
    needle_.close(z_, tool);
    output_.contact = needle_.inside();
    needle_.add(output_.force, output_.torque);
  } else {
    close_touch(tool);
  }
  if (others_.add_own(tool, output_.force, output_.torque)) output_.contact = true;
  bend(Vec3::Zero(), Vec3::Zero());
  fade(Vec3::Zero());
}

/// Updates the other contacts; the tool's own contact pushes as in the step before, where it was then: has_response_ is about
/// where it is now.
void PatchPlayer::close_others(const ToolPose& tool) noexcept {
  if (others_.empty()) return;
  const auto r = patch_.modes();
  ModeVector own = ModeVector::Zero(r);
  if (touching_ && r > 0) own.noalias() += (1 - share_before_) * (response_.topRows(r) * push_);
  if (needle_.inside()) own += needle_.moved();
  others_.close(z_, own, tool);
}

void PatchPlayer::separate(const Vec3& gap) noexcept {
  clearance_ = clearance_of(point_, gap, normal_at(surface(), positions(), point_));
  clearance_.known &= beyond_.isZero(0);
}

void PatchPlayer::close_touch(const ToolPose& pose) noexcept {
  place_vertices();
  const SurfaceView view = surface();
  const double radius_m = patch_.sphere.radius_m;
  const Vec3 arm = pose.turn * patch_.sphere.centre, centre = pose.position + arm;
  Vec3 normal = Vec3::Zero();
  if (!touching_) {
    const Onset onset = look_for_contact(view, positions(), centre, radius_m, clearance_);
    if (!onset.touches || onset.nearest.at_border) return;
    point_ = onset.nearest.point;
    touching_ = true;
    beyond_.setZero();
    has_response_ = false;
  }
  const ContactParameters parameters{patch_.contact_stiffness_n_m, patch_.friction};
  ContactClosure closure;
  for (int slides = 0;; ++slides) {
    if (!has_response_) update_response();
    const Vec3 p_free = position_at(view, positions(), point_) + beyond_;
    normal = normal_at(view, positions(), point_);
    closure = close_contact(p_free, compliance_, normal, centre - radius_m * normal, parameters);
    touching_ = closure.touching;
    if (!touching_) return separate(centre - p_free);
    if (closure.slip.squaredNorm() > 0) {
      point_ = slide(view, positions(), point_, beyond_ + closure.slip);
      beyond_ = beyond_border(view, positions(), point_, p_free + closure.slip);
      has_response_ = false;
    }
    if (slides == kSlidesMax || closure.slip.norm() < kSlipToleranceM) break;
  }
  if (patch_.modes() > 0) {
    carried_.noalias() = response_ * closure.lambda;
    z_ += (1 - share_before_) * carried_;
    carried_ *= share_before_;
  }
  push_ = closure.lambda;
  output_ = {-push_, true, Vec3::Zero()};
  if (patch_.turn) output_.torque = -(arm - radius_m * normal).cross(push_);
  if (!needle_.punctures(push_, pose)) return;
  needle_.enter(z_, position_at(view, positions(), point_) + beyond_);
  touching_ = false;
  clearance_ = {};
}

Vec3 PatchPlayer::vertex(int i) const {
  Vec3 at = rest_.segment<3>(3 * i);
  if (patch_.modes() > 0) at += rows_.middleRows<3>(3 * i) * z_.head(patch_.modes());
  return at;
}

double PatchPlayer::energy() const {
  const auto r = patch_.modes();
  if (r == 0) return 0;
  return 0.5 * (z_.tail(r).squaredNorm() + z_.head(r).cwiseAbs2().dot(patch_.stiffness));
}

}  // namespace palpate
