#include "client/core/haptic_tick.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kNoStiffness = 1e-9;  // [1/s^2]: a mode that moves freely

/// n^T (R K^-1 R^T + c_static) n + 1 / k_c of a contact with R^T n = `moves` and `instant` = n^T c_static n [m/N].
double compliance_of(const Patch& patch, const ModeVector& moves, double instant) {
  double compliance = instant + (patch.contact_stiffness_n_m > 0 ? 1 / patch.contact_stiffness_n_m : 0);
  for (int mode = 0; mode < patch.modes(); ++mode)
    if (patch.stiffness[mode] > kNoStiffness) compliance += moves[mode] * moves[mode] / patch.stiffness[mode];
  return compliance;
}

/// Stiffness of one contact along its normal [N/m], 0 where it has none.
struct StiffContact {
  double stiffness_n_m = 0;
  Vec3 normal = Vec3::Zero();
};

StiffContact stiff_contact(double compliance, const Vec3& normal) { return {compliance > 0 ? 1 / compliance : 0, normal}; }

/// Contact at the patch's point.
StiffContact contact_at_point(const Patch& patch) {
  const Triangle& corner = patch.surface.triangles[patch.point.triangle];
  const auto vertex = [&](std::size_t k) -> const PortVertex& { return patch.surface.vertices[corner[k]]; };
  const Vec3 across = (vertex(1).position - vertex(0).position).cross(vertex(2).position - vertex(0).position);
  if (!(across.squaredNorm() > 0)) return {};
  const Vec3 normal = across.normalized();
  ModeVector moves = ModeVector::Zero(patch.modes());
  for (std::size_t k = 0; k < 3; ++k)
    moves.noalias() += patch.point.weight[static_cast<Eigen::Index>(k)] * (vertex(k).rows.transpose() * normal);
  return stiff_contact(compliance_of(patch, moves, normal.dot(patch.c_static * normal)), normal);
}

StiffContact contact_of(const Patch& patch, const OtherContact& other) {
  return stiff_contact(
      compliance_of(patch, other.rows.transpose() * other.normal, other.normal.dot(other.c_static * other.normal)), other.normal);
}

/// The other contacts of the tool's own body.
std::span<const OtherContact> own_contacts(const Patch& patch) {
  return patch.others.tools().first(static_cast<std::size_t>(patch.others.own));
}

double largest_eigenvalue(const Mat3& symmetric) {
  Eigen::SelfAdjointEigenSolver<Mat3> values;
  values.computeDirect(symmetric, Eigen::EigenvaluesOnly);
  return values.eigenvalues()[2];
}

/// Returns the largest rate at which a patch's force grows against a tool that moves in the next tick [N/m].
double stiffness_of(const Patch& patch, double dt_s) {
  if (patch.constant) return 0;
  if (patch.contact == ContactKind::touch) return (1 + patch.others.own) * patch.contact_stiffness_n_m;
  return (patch.k_port + patch.d_port / dt_s).norm();
}

}  // namespace

double stiffness_of_port(const Patch& patch) noexcept {
  if (patch.constant) return 0;
  if (patch.contact == ContactKind::attach) return largest_eigenvalue(patch.k_port);
  double stiffness = contact_at_point(patch).stiffness_n_m;
  for (const OtherContact& other : own_contacts(patch)) stiffness += contact_of(patch, other).stiffness_n_m;
  return stiffness;
}

double torsion_of_port(const Patch& patch) noexcept {
  if (patch.constant || patch.contact == ContactKind::attach || !patch.turn) return 0;
  Mat3 torsion = Mat3::Zero();
  const auto add = [&](const StiffContact& contact, const ToolSphere& sphere) {
    const Vec3 lever = (*patch.turn * sphere.centre).cross(contact.normal);
    torsion += contact.stiffness_n_m * lever * lever.transpose();
  };
  add(contact_at_point(patch), patch.sphere);
  for (const OtherContact& other : own_contacts(patch)) add(contact_of(patch, other), other.sphere);
  return largest_eigenvalue(torsion);
}

HapticTick::HapticTick(LatestSlot<PatchPlayer>& patches, SampleRing& samples, const GuardLimits& limits,
                       const CouplingParameters& coupling)
    : patches_(patches), samples_(samples), guard_(limits), coupling_(coupling) {}

void HapticTick::restart() noexcept {
  guard_.restart();
  gain_ = wall_gain_ = 0;
  touches_ = {};
  fade_offset_ = {};
  fade_left_ = 0;
  damper_.restart();
  coupled_hand_.restart();
  guidance_ = Vec3::Zero();
}

/// Restarts after a gap. A patch that is too old by then is discarded: its prediction for the gap is worthless, and there is no
/// time to play it.
void HapticTick::restart_after_gap(Micros now) noexcept {
  restart();
  if (has_player_ && now - stamp_ > valid_for()) {
    has_player_ = false;
    environment_ = {};
  }
}

/// Returns the validity of the patch in use, within our own bounds.
Micros HapticTick::valid_for() const noexcept {
  const Micros most = horizon() > Micros{} ? kValidBeyondAge + horizon() : kValidMost;
  return std::min(player_.patch().valid_for, most);
}

/// Returns the scale k_max / k of the header.
double HapticTick::share_of(const Patch& patch) const noexcept {
  const GuardLimits& limits = guard_.limits();
  const auto scale = [&](double most, double (*of)(const Patch&) noexcept) {
    if (most <= 0) return 1.0;
    const double stiffness = of(patch);
    return stiffness > most ? most / stiffness : 1.0;
  };
  return std::min(scale(limits.stiffness_max_n_m, &stiffness_of_port),
                  limits.renders_torque ? scale(limits.torsion_stiffness_max_nm_rad, &torsion_of_port) : 1.0);
}

/// Renews the patch in use, which is as good as one stamped `stamp`.
void HapticTick::renew(Micros stamp, Micros now) noexcept {
  if (has_player_) note_ages(stamp, now);
  stamp_ = stamp;
}

/// Notes the age of the patch in use when one stamped `next_stamp` takes over at `now`. The age of a patch beyond its validity
/// reflects a pause (no contact in reach, no link), not the ages in use; but if the new patch is older on arrival than patches
/// used to be, the link has become slower.
void HapticTick::note_ages(Micros next_stamp, Micros now) noexcept {
  const Micros reached = now - stamp_, came = now - next_stamp;
  if (reached <= valid_for())
    note_age(reached);
  else if (came > horizon())
    note_age(came);
}

void HapticTick::note_age(Micros age) noexcept {
  const auto us = static_cast<double>(age.count());
  if (age_mean_us_ <= 0) {
    age_mean_us_ = us;
    age_deviation_us_ = us / 8;
  } else {
    age_deviation_us_ += (std::abs(us - age_mean_us_) - age_deviation_us_) / 8;
    age_mean_us_ += (us - age_mean_us_) / 16;
  }
  horizon_us_.store(static_cast<std::int64_t>(age_mean_us_ + 2 * age_deviation_us_), std::memory_order_relaxed);
}

int HapticTick::cross_fade_ticks(double step_n, double force_n) noexcept {
  constexpr double kUnnoticedN = 0.05, kUnnoticedShare = 0.05, kWithinTicks = 5;
  const double steps = step_n / std::max(kUnnoticedN, kUnnoticedShare * force_n);  // number of unnoticeable steps
  const double ticks = std::ceil(std::max(steps, std::min<double>(kWithinTicks * steps, kCrossFadeUsual)));
  return ticks < kCrossFadeMost ? std::max(kCrossFadeLeast, static_cast<int>(ticks)) : kCrossFadeMost;
}

void HapticTick::hand_over(PatchPlayer& next, const ToolSample& now) noexcept {
  // Replay the samples that the network side had not seen yet.
  for (std::size_t k = recent_.first_after(next.time()); k < recent_.size(); ++k) next.advance(recent_[k]);
  renew(std::max(next.patch().stamp, std::min(renewed_to(), next.patch().stamp + kRenewedMost)), now.t);
  // The same patch again is one whose terms have arrived.
  const bool another = !has_player_ || next.patch().seq != player_.patch().seq;
  counts_.patches_used += another;
  const PlayerOutput old = has_player_ ? player_.advance(now) : PlayerOutput{};
  const Wrench before = softening_ * Wrench(old.force, old.torque) + fade_offset_;
  softening_ = share_of(next.patch());
  counts_.softened += another && softening_ < 1;
  counts_.softened_most = std::min(counts_.softened_most, softening_);
  const PlayerOutput fresh = next.advance(now);
  const Wrench after = softening_ * Wrench(fresh.force, fresh.torque), step = before - after;
  player_ = next;
  damper_.play(next.patch());
  if (has_player_) {
    fade_offset_ = step;
    fade_left_ = cross_fade_ticks(step.force.norm(), after.force.norm());
    counts_.hand_over_step_max_n = std::max(counts_.hand_over_step_max_n, step.force.norm());
  }
  has_player_ = true;
}

/// Moves the virtual tool, substitutes it for the device and returns the force on the device.
Vec3 HapticTick::couple_to_tool(ToolSample& sample, double dt_s) noexcept {
  if (recent_.empty()) tool_ = {sample.position, Vec3::Zero(), sample.position};
  const double of_patch = environment_.force.squaredNorm() > 0 ? stiffness_of(player_.patch(), dt_s) : 0;
  const double stiffness = of_patch + wall_stiffness_ + coupled_hand_.stiffness_n_m() + coupled_hand_.damping_n_s_m() / dt_s;
  const Vec3 force = couple(coupling_, tool_, sample.position, {environment_.force + guidance_, stiffness}, dt_s);
  sample.position = tool_.position;
  return force;
}

/// Returns the wrench of player and damper after cross-fade and fade.
Wrench HapticTick::patch_wrench(const ToolSample& sample, double dt_s, TickOutput& out) noexcept {
  const Patch& patch = player_.patch();
  out.has_patch = true;
  out.contact = player_.output().contact;
  out.tip = player_.needle_tip();
  out.patch_stamp = stamp_;
  out.patch_age = sample.t - stamp_;
  Wrench wrench = softening_ * Wrench(player_.output().force, player_.output().torque);
  if (fade_left_ > 0) {
    wrench += fade_offset_;
    fade_offset_ *= static_cast<double>(fade_left_ - 1) / fade_left_;
    --fade_left_;
  }
  wrench.force += damper_.tick(sample.position, out.contact, seconds(std::max(horizon(), out.patch_age)), dt_s, guidance_active_);
  out.grip = softening_ * player_.output().grip;
  out.outlived = out.patch_age > valid_for() || sample.t.count() > server_until_us_.load(std::memory_order_acquire);
  const bool good = !out.outlived && (sample.position - patch.tool).norm() <= patch.trust_radius_m;
  const double target = good ? 1.0 : 0.0;
  // At zero force nothing is felt, so no fade is needed: a contact that begins with a fresh patch is felt at once.
  const bool felt = wrench.force.squaredNorm() > 0 || wrench.torque.squaredNorm() > 0;
  gain_ = felt ? std::clamp(target, gain_ - 1.0 / kFadeTicks, gain_ + 1.0 / kFadeTicks) : target;
  if (gain_ < 1) ++counts_.faded_ticks;
  out.gain = felt ? gain_ : 1;
  out.grip *= gain_;
  return gain_ * guard_.clamped(wrench);
}

/// Returns the wrench of the rigid parts.
Wrench HapticTick::wall_wrench(const ToolSample& sample) noexcept {
  const PartWalls* const walls = walls_.load(std::memory_order_acquire);
  if (walls && walls != met_) {
    met_ = walls;
    touches_ = {};
  }
  const bool met = walls && sample.t.count() <= walls_until_us_.load(std::memory_order_relaxed);
  wall_gain_ = std::clamp(met ? 1.0 : 0.0, wall_gain_ - 1.0 / kFadeTicks, wall_gain_ + 1.0 / kFadeTicks);
  wall_stiffness_ = 0;
  if (!(wall_gain_ > 0)) touches_ = {};
  if (!met_ || !(wall_gain_ > 0)) return {};
  const double most = guard_.limits().stiffness_max_n_m;
  const double stiffness = most > 0 ? std::min(met_->stiffness_n_m(), most / 2) : met_->stiffness_n_m();
  const Wrench wrench = wall_gain_ * met_->push(ToolPose(sample), stiffness, touches_);
  if (wrench.force.squaredNorm() > 0) wall_stiffness_ = stiffness;
  return wrench;
}

/// Returns the force of guidance, and notes it for the network thread.
Vec3 HapticTick::guidance_force(const ToolSample& sample, double dt_s) noexcept {
  constexpr double kMeanS = 0.1;
  if (const PartnerTool* const partner = partners_.take()) coupled_hand_.hear(*partner, sample.t);
  if (coupled_hand_.idle() && !guidance_active_) return Vec3::Zero();
  const bool held = coupled_hand_.hand() == GuidanceHand::holds;
  const Vec3 force = coupled_hand_.tick(sample, dt_s);
  const double norm = force.norm();
  guidance_active_ = !coupled_hand_.idle();
  guidance_mean_n_ = guidance_active_ ? guidance_mean_n_ + dt_s / (kMeanS + dt_s) * (norm - guidance_mean_n_) : 0;
  const GuidanceHand hand = coupled_hand_.hand();
  if (hand == GuidanceHand::holds) {
    counts_.holds += !held;
    ++counts_.guided_ticks;
    counts_.guidance_sum_n += norm;
    counts_.guidance_max_n = std::max(counts_.guidance_max_n, norm);
  }
  guidance_hand_.store(static_cast<std::uint8_t>(hand), std::memory_order_relaxed);
  guidance_reach_us_.store(from_seconds(coupled_hand_.reach_s()).count(), std::memory_order_relaxed);
  guidance_force_n_.store(guidance_mean_n_, std::memory_order_relaxed);
  return force;
}

TickOutput HapticTick::tick(const ToolSample& reading) noexcept {
  ++counts_.ticks;
  const bool usable = in_world(reading.position), first = recent_.empty();
  // An invalid reading would stay in a model: the tool counts as standing still.
  if (usable) device_.position = reading.position;
  const bool turns = reading.orientation && is_unit(*reading.orientation);
  if (turns) device_.turn = *reading.orientation;
  if (std::isfinite(reading.opening)) device_.opening = std::clamp(reading.opening, 0.0, 1.0);
  ToolSample sample{reading.t, device_.position, turns ? reading.orientation : Orientation(), device_.opening};
  const Micros passed = first ? kTick : sample.t - recent_.newest().t;
  const bool coupled = coupling_.stiffness_n_m > 0;
  Vec3 coupling_force = Vec3::Zero();
  if (coupled && (usable || !first)) coupling_force = couple_to_tool(sample, seconds(std::max(passed, Micros{1})));
  if (!samples_.push(usable ? sample : ToolSample{reading.t, reading.position})) ++counts_.samples_dropped;
  if (first && !usable) return {};

  TickOutput out;
  out.opening = sample.opening;
  if (seconds(passed) > Guard::kGapMaxS) restart_after_gap(sample.t);
  // A patch that is this old came from before a pause: playing it up to now would need more than a tick.
  PatchPlayer* const next = patches_.take();
  if (next && sample.t - next->time() <= kValidBeyondAge) {
    hand_over(*next, sample);
    out.swapped = true;
    out.hand_over_step_n = fade_offset_.force.norm();
  } else if (has_player_) {
    player_.advance(sample);
  }
  if (has_player_)
    if (const Micros renewed = std::min(renewed_to(), player_.patch().stamp + kRenewedMost); renewed > stamp_)
      renew(renewed, sample.t);
  recent_.add(sample);
  if (has_player_) environment_ = patch_wrench(sample, seconds(std::max(passed, Micros{1})), out);
  if (met_ || walls_.load(std::memory_order_relaxed))
    environment_ = (has_player_ ? environment_ : Wrench()) + wall_wrench(sample);
  // The virtual tool passes the force of guidance on to the device a tick later.
  const Vec3 led = guidance_;
  guidance_ = guidance_force(sample, seconds(std::max(passed, Micros{1})));
  out.guidance = coupled ? led : guidance_;
  out.model_force = coupled ? Vec3(coupling_force - led) : environment_.force;
  out.model_torque = environment_.torque;
  const Wrench shown = guard_.pass({out.model_force, out.model_torque}, device_, seconds(passed), out.guidance);
  out.force = shown.force;
  out.torque = shown.torque;
  return out;
}

}  // namespace palpate
