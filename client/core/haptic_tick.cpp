#include "client/core/haptic_tick.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

/// How fast a patch's force grows against a tool that moves on in the next tick, at most [N/m].
double stiffness_of(const Patch& patch, double dt_s) {
  if (patch.constant) return 0;
  if (patch.contact == ContactKind::touch) return patch.coupling_n_m;
  return (patch.k_port + patch.d_port / dt_s).norm();
}

}  // namespace

HapticTick::HapticTick(LatestSlot<PatchPlayer>& patches, SampleRing& samples, const GuardLimits& limits,
                       const CouplingParameters& coupling)
    : patches_(patches), samples_(samples), guard_(limits), coupling_(coupling) {}

/// The patch in use, new or known to live on, is as good as one stamped `stamp`.
void HapticTick::renew(Micros stamp, Micros now) noexcept {
  if (has_player_) note_ages(stamp, now);
  stamp_ = stamp;
}

/// How old the patch in use got when one stamped `next_stamp` takes over at `now`. One that outlived what it may tells of a pause
/// (no contact in reach, no link), not of the ages in use; but one that comes older than patches used to get tells that its way
/// became longer.
void HapticTick::note_ages(Micros next_stamp, Micros now) noexcept {
  const Micros reached = now - stamp_, came = now - next_stamp;
  if (reached <= player_.patch().valid_for)
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
  const double steps = step_n / std::max(kUnnoticedN, kUnnoticedShare * force_n);  // each of which goes unnoticed
  const double ticks = std::ceil(std::max(steps, std::min<double>(kWithinTicks * steps, kCrossFadeUsual)));
  return ticks < kCrossFadeMost ? std::max(kCrossFadeLeast, static_cast<int>(ticks)) : kCrossFadeMost;
}

void HapticTick::hand_over(PatchPlayer& next, const ToolSample& now) noexcept {
  // What the network side had not seen yet; recent_ holds the ticks before this one.
  const std::uint64_t oldest = recent_count_ > kRecent ? recent_count_ - kRecent : 0;
  for (std::uint64_t k = oldest; k < recent_count_; ++k) {
    const ToolSample& sample = recent_[k % kRecent];
    if (sample.t > next.time()) next.advance(sample);
  }
  if (has_player_) next.inherit(player_);
  renew(std::max(next.patch().stamp, lives_on()), now.t);
  // The same patch once more is one whose terms have come.
  if (!has_player_ || next.patch().seq != player_.patch().seq) ++counts_.patches_used;
  const Vec3 step = (has_player_ ? Vec3(player_.advance(now).force + fade_offset_) : Vec3::Zero()) - next.advance(now).force;
  player_ = next;
  if (has_player_) {
    fade_offset_ = step;
    fade_left_ = cross_fade_ticks(step.norm(), next.output().force.norm());
    counts_.hand_over_step_max_n = std::max(counts_.hand_over_step_max_n, step.norm());
  }
  has_player_ = true;
}

/// Moves the virtual tool, puts it in the device's place and returns the force on the device.
Vec3 HapticTick::couple_to_tool(ToolSample& sample, double dt_s) noexcept {
  if (recent_count_ == 0) tool_ = {sample.position, Vec3::Zero(), sample.position};
  const double stiffness = environment_.squaredNorm() > 0 ? stiffness_of(player_.patch(), dt_s) : 0;
  const Vec3 force = couple(coupling_, tool_, sample.position, {environment_, stiffness}, dt_s);
  sample.position = tool_.position;
  return force;
}

/// Cross-fade and fade of the player's force.
Vec3 HapticTick::patch_force(const ToolSample& sample, TickOutput& out) noexcept {
  const Patch& patch = player_.patch();
  out.has_patch = true;
  out.contact = player_.output().contact;
  out.patch_stamp = stamp_;
  out.patch_age = sample.t - stamp_;
  Vec3 force = player_.output().force;
  if (fade_left_ > 0) {
    force += fade_offset_;
    fade_offset_ *= static_cast<double>(fade_left_ - 1) / fade_left_;
    --fade_left_;
  }
  out.outlived = out.patch_age > patch.valid_for;
  const bool good = !out.outlived && (sample.position - patch.tool).norm() <= patch.trust_radius_m;
  const double target = good ? 1.0 : 0.0;
  // Nothing is felt at zero force, so nothing need be faded: a contact that begins with a fresh patch is felt at once.
  const bool felt = force.squaredNorm() > 0;
  gain_ = felt ? std::clamp(target, gain_ - 1.0 / kFadeTicks, gain_ + 1.0 / kFadeTicks) : target;
  if (gain_ < 1) ++counts_.faded_ticks;
  out.gain = felt ? gain_ : 1;
  return gain_ * guard_.clamped(force);
}

TickOutput HapticTick::tick(const ToolSample& reading) noexcept {
  ++counts_.ticks;
  const bool usable = in_world(reading.position), first = recent_count_ == 0;
  // A reading outside, once in a model, would stay there: the tool counts as standing still.
  if (usable) device_ = reading.position;
  ToolSample sample{reading.t, device_};
  const Micros passed = first ? kTick : sample.t - recent_[(recent_count_ - 1) % kRecent].t;
  const bool coupled = coupling_.stiffness_n_m > 0;
  Vec3 coupling_force = Vec3::Zero();
  if (coupled && (usable || !first)) coupling_force = couple_to_tool(sample, seconds(std::max(passed, Micros{1})));
  if (!samples_.push(usable ? sample : reading)) ++counts_.samples_dropped;
  if (first && !usable) return {};

  TickOutput out;
  if (PatchPlayer* next = patches_.take()) {
    hand_over(*next, sample);
    out.swapped = true;
    out.hand_over_step_n = fade_offset_.norm();
  } else if (has_player_) {
    player_.advance(sample);
  }
  if (has_player_ && lives_on() > stamp_) renew(lives_on(), sample.t);
  recent_[recent_count_++ % kRecent] = sample;
  if (has_player_) environment_ = patch_force(sample, out);
  out.model_force = coupled ? coupling_force : environment_;
  out.force = guard_.pass(out.model_force, device_, seconds(passed));
  return out;
}

}  // namespace palpate
