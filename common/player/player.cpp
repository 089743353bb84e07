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
  tool_ = {patch.tool, patch.turn.value_or(Rotation::Identity()), patch.opening};
  if (patch.contact == ContactKind::touch) {
    surface_ = PlayedSurface(patch_.surface, r, psi0_);
    contact_ = SurfaceContact(patch.point, patch.touching && !patch.needle.tip.inside && patch.suture.empty(), patch.c_static);
    if (nonlinear_.empty() && r > 0 && !surface_.empty()) contact_.compensate_slides(patch_, surface_);
    others_ = OtherContacts(patch, surface_, psi0_, dt_);
    if (r > 0) others_.take_from(drift_);
    needle_ = NeedleContacts(patch, psi0_);
    suture_ = SutureContact(patch, psi0_);
    push_.response.setZero(2 * r, 3);
    if (contact_.touching() && r > 0) {
      contact_.respond(surface_, patch.contact_stiffness_n_m, push_);
      push_.lambda = -patch.force;
      for (int j = 0; j < patch.others.own; ++j) push_.lambda -= others_.push(j);
    }
    if (!surface_.empty()) contact_.separate(surface_, tool_.centre_of(patch.sphere) - contact_.place(surface_));
  }
  time_ = patch.stamp;
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

void PatchPlayer::step_touch(const ToolPose& tool) noexcept {
  const auto r = patch_.modes();
  if (r > 0) {
    StateVector next = drift_;
    push_.carry_on(next);
    if (has_forces()) next.noalias() += psi0_ * forces().tail(r);
    next.noalias() += transition_ * z_;
    if (!others_.empty()) others_.carry_on(next);
    if (!needle_.empty()) needle_.carry_on(next);
    if (!suture_.empty()) suture_.carry_on(next);
    z_ = next;
  }
  close_others(tool);
  output_ = {};
  if (!suture_.empty()) {
    suture_.close(z_, tool.position);
    output_ = {suture_.force(), true};
  } else if (needle_.inside()) {
    push_.lambda.setZero();
    const Vec3 arm = tool.arm_of(patch_.sphere);
    needle_.close(z_, {tool.position + arm, tool.turn});
    output_.contact = needle_.inside();
    needle_.add(output_.force, output_.torque);
    output_.torque += arm.cross(output_.force);
    output_.grip = grip_of(patch_.sphere, tool.turn, arm, output_.force);
  } else {
    close_touch(tool);
  }
  if (others_.add_own(tool, output_.force, output_.torque, output_.grip)) output_.contact = true;
  bend(Vec3::Zero(), Vec3::Zero());
  fade(Vec3::Zero());
}

/// Updates the other contacts; the tool's own contact pushes as in the step before, where it was then.
void PatchPlayer::close_others(const ToolPose& tool) noexcept {
  if (others_.empty()) return;
  const auto r = patch_.modes();
  ModeVector own = ModeVector::Zero(r);
  if (contact_.touching() && r > 0) own += push_.moved();
  if (needle_.inside()) own += needle_.moved();
  others_.close(z_, own, tool, surface_);
}

void PatchPlayer::close_touch(const ToolPose& pose) noexcept {
  if (surface_.empty()) return;
  const auto r = patch_.modes();
  surface_.place(z_.head(r));
  const Vec3 arm = pose.arm_of(patch_.sphere);
  contact_.close(surface_, pose.position + arm, patch_.sphere.radius_m, {patch_.contact_stiffness_n_m, patch_.friction}, push_);
  if (!contact_.touching()) return;
  if (r > 0) push_.add_to(z_);
  output_ = {-push_.lambda, true};
  if (patch_.turn) {
    const Vec3 place = arm - patch_.sphere.radius_m * contact_.normal();
    output_.torque = -place.cross(push_.lambda);
    output_.grip = -grip_of(patch_.sphere, pose.turn, place, push_.lambda);
  }
  if (!needle_.punctures(push_.lambda, pose)) return;
  needle_.enter(z_, contact_.place(surface_));
  contact_.leave();
}

Vec3 PatchPlayer::vertex(int i) const { return surface_.vertex(i, z_.head(patch_.modes())); }

double PatchPlayer::energy() const {
  const auto r = patch_.modes();
  if (r == 0) return 0;
  return 0.5 * (z_.tail(r).squaredNorm() + z_.head(r).cwiseAbs2().dot(patch_.stiffness));
}

}  // namespace palpate
