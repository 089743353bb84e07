// The haptic tick: newest patch -> player -> fade -> guard. Called once a millisecond by the one haptic thread.
//
// A new patch is first replayed over the last few ticks that the network side had not seen, and then takes over. The step of the
// force at the swap is measured and decays linearly to zero over 4 to 25 ticks, more ticks the larger it is relative to the
// just-noticeable change: it changes the force by at most max(0.05 N, 5 % of the force) in 5 ms where 10 ticks are enough for
// that, and in any one tick where 25 are. A patch that is too old, or whose trust radius the tool has left, fades to zero over
// kFadeTicks; a patch that is good again fades in. The force that fades is the one that the device can show. Does not allocate,
// lock, log or throw.
//
// The server is trusted within these bounds only:
//     a patch is valid for min(valid_for, kValidMost), and once the age a of patches in use is known, min(valid_for,
//     kValidBeyondAge + a); it is renewed for at most kRenewedMost after its stamp, and only while the server is there: until
//     server_until(), the last moment for which the network side vouches for it.
// Beyond any of these the patch fades like one that is too old. After a gap of more than Guard::kGapMaxS between ticks, and after
// restart(), the force begins at zero, and a patch that has become too old meanwhile is discarded.
//
// The force of a partner's guidance (guidance.hpp) acts on the same tool; it depends neither on a patch nor on its age.
//
// Where other tools touch the body, a damper is added to the patch's force (hands_damper.hpp).
//
// On a tool with a body there is a torque about the tool point too. It shares every fade, scale and limit of the force; a device
// that renders none gets none (guard.hpp).
//
// Where the device can render a stiffness of k_max and the patch has more, k (stiffness_of_port), the force is scaled by k_max /
// k: a passive force times a constant is passive. The same holds for a torsional stiffness (torsion_of_port); the smaller scale
// counts, for both.
//
// Rigid parts of the scene push the tool wherever it is, patch or not (part_walls.hpp), each contact with at most half of k_max;
// their wrench fades when the server falls silent, over kFadeTicks.
//
// With a virtual coupling (virtual_coupling.hpp; for devices with little damping) the patch meets the virtual tool instead of the
// device, and so does the server through the samples. The device feels the coupling: one tick later, and never stiffer than k_c.
// The virtual tool turns with the device, which feels the torque directly.
#pragma once

#include <atomic>

#include "client/core/button_changes.hpp"
#include "client/core/guidance.hpp"
#include "client/core/hands_damper.hpp"
#include "client/guard/guard.hpp"
#include "client/guard/virtual_coupling.hpp"
#include "common/base/latest_slot.hpp"
#include "common/base/sample_history.hpp"
#include "common/base/spsc_ring.hpp"
#include "common/player/part_walls.hpp"
#include "common/player/player.hpp"

namespace palpate {

inline constexpr std::size_t kSampleRing = 1024;
using SampleRing = SpscRing<ToolSample, kSampleRing>;

/// True when `position` is finite and inside the world.
inline bool in_world(const Vec3& position) noexcept {
  return position.allFinite() && position.cwiseAbs().maxCoeff() <= kWorldExtentM;
}

struct TickOutput {
  Vec3 force = Vec3::Zero(),
       torque = Vec3::Zero();  ///< for the device to render, after the guard [N], about the tool point [N m]
  Vec3 model_force = Vec3::Zero(), model_torque = Vec3::Zero();  ///< before the guard, without guidance
  double opening = 0;                                            ///< of the jaws, as played
  double grip = 0;               ///< on the opening of the jaws, by the patch, with its share displayed (tool_shape.hpp) [N m]
  NeedleTip tip;                 ///< of a needle, by the patch
  Vec3 guidance = Vec3::Zero();  ///< force of guidance before the guard [N]
  bool contact = false;
  bool has_patch = false;
  Micros patch_age{};           ///< now minus patch_stamp
  Micros patch_stamp{};         ///< stamp of the patch in use, or the later moment to which the server renewed it
  bool swapped = false;         ///< true: a new patch took over in this tick
  double hand_over_step_n = 0;  ///< force step of that hand-over before the cross-fade [N]
  double gain = 1;              ///< displayed share of the patch's force, below 1 while it fades
  bool outlived = false;        ///< true: the patch in use is older than its validity
  Wrench wrench() const { return {force, torque}; }
};

/// Bounds of the server's claims (see above).
inline constexpr Micros kValidMost{5'000'000}, kValidBeyondAge{1'000'000}, kRenewedMost{1'000'000};

/// Returns the stiffness that a patch shows to a hand at its port [N/m]. For attach: the largest eigenvalue of K_p, with all
/// modes at rest. For touch: 1 / (n^T (R K^-1 R^T + c_static) n + 1 / k_c) along the normal n at the patch's point, after all
/// modes have followed, modes without stiffness omitted, summed over the contacts of the tool's body. 0 for a constant patch.
double stiffness_of_port(const Patch& patch) noexcept;

/// Returns the torsional stiffness that a patch shows to a hand about the tool point [N m/rad]: the largest eigenvalue of
/// sum_j k_j (R a_j x n_j)(R a_j x n_j)^T over the contacts of the tool's body, with k_j those of stiffness_of_port. 0 for a
/// point.
double torsion_of_port(const Patch& patch) noexcept;

struct HapticCounts {
  std::uint64_t ticks = 0, samples_dropped = 0, patches_used = 0, faded_ticks = 0;
  std::uint64_t softened = 0;  ///< patches whose force was scaled down because they are stiffer than the device can render
  double softened_most = 1;    ///< smallest scale used
  double hand_over_step_max_n = 0;
  // guidance
  std::uint64_t guided_ticks = 0, holds = 0;      ///< ticks with its force; times that it began
  double guidance_sum_n = 0, guidance_max_n = 0;  ///< sum of the norms over these ticks; the largest
  double guidance_mean_n() const { return guided_ticks > 0 ? guidance_sum_n / static_cast<double>(guided_ticks) : 0; }
};

class HapticTick {
 public:
  /// `coupling`: no stiffness means no coupling.
  HapticTick(LatestSlot<PatchPlayer>& patches, SampleRing& samples, const GuardLimits& limits,
             const CouplingParameters& coupling = {});
  /// Runs one tick. `sample.t` is on the client's clock and grows by kTick (the caller skips late ticks and never runs two in a
  /// row). A reading outside the world is not played: the tool counts as standing still. An orientation that is not of unit
  /// length counts as none, an opening outside 0 to 1 as the nearest, one that is no number as the last.
  TickOutput tick(const ToolSample& reading) noexcept;
  /// Sets the limits of the device. Before the first tick only.
  void limit(const GuardLimits& limits) noexcept { guard_ = Guard(limits); }
  /// Begins the force at zero again, after the device showed nothing. Haptic thread.
  void restart() noexcept;
  /// Says that the server is there until `moment`, as far as the network side knows. Any thread, one at a time; unlimited before
  /// the first call.
  void server_until(Micros moment) noexcept { server_until_us_.store(moment.count(), std::memory_order_release); }
  /// Sets the rigid parts that the tool meets until `moment`, which must outlive the tick; null: none. Any thread, one at a time.
  void meet(const PartWalls* walls, Micros moment) noexcept {
    walls_until_us_.store(moment.count(), std::memory_order_relaxed);
    walls_.store(walls, std::memory_order_release);
  }
  /// Returns the age that patches reach before the next one takes over: smoothed mean plus twice the mean deviation (as TCP does
  /// with round trips); 0 before the second patch. Any thread.
  Micros horizon() const noexcept { return Micros{horizon_us_.load(std::memory_order_relaxed)}; }
  /// Says that the server considers the patch in use as good as one stamped `stamp`. Any thread, one at a time.
  void renew_to(Micros stamp) noexcept { renewed_to_us_.store(stamp.count(), std::memory_order_relaxed); }
  /// The tool's buttons, which the haptic thread leaves for the network thread.
  ButtonChanges& buttons() noexcept { return buttons_; }
  /// Passes on a message about the partner of a guidance. Any thread, one at a time.
  void hear(const PartnerTool& partner) noexcept {
    partners_.back() = partner;
    partners_.publish();
  }
  /// Returns the state of guidance. Any thread.
  GuidanceReport guidance() const noexcept {
    return {static_cast<GuidanceHand>(guidance_hand_.load(std::memory_order_relaxed)),
            Micros{guidance_reach_us_.load(std::memory_order_relaxed)}, guidance_force_n_.load(std::memory_order_relaxed)};
  }
  /// Notes that the haptic thread woke late for this tick.
  void note_late() noexcept { late_ticks_.store(late_ticks() + 1, std::memory_order_relaxed); }
  /// Number of late ticks. Any thread.
  std::uint32_t late_ticks() const noexcept { return late_ticks_.load(std::memory_order_relaxed); }
  const HapticCounts& counts() const { return counts_; }
  const GuardCounts& guard_counts() const { return guard_.counts(); }
  const GuardLimits& limits() const { return guard_.limits(); }

 private:
  static constexpr int kRecent = 64;
  static constexpr int kCrossFadeLeast = 4, kCrossFadeUsual = 10, kCrossFadeMost = 25;
  static constexpr int kFadeTicks = 50;

  Micros renewed_to() const noexcept { return Micros{renewed_to_us_.load(std::memory_order_relaxed)}; }
  void restart_after_gap(Micros now) noexcept;
  Micros valid_for() const noexcept;
  double share_of(const Patch& patch) const noexcept;
  void renew(Micros stamp, Micros now) noexcept;
  void note_ages(Micros next_stamp, Micros now) noexcept;
  void note_age(Micros age) noexcept;
  static int cross_fade_ticks(double step_n, double force_n) noexcept;
  void hand_over(PatchPlayer& next, const ToolSample& now) noexcept;
  Vec3 couple_to_tool(ToolSample& sample, double dt_s) noexcept;
  Wrench patch_wrench(const ToolSample& sample, double dt_s, TickOutput& out) noexcept;
  Vec3 guidance_force(const ToolSample& sample, double dt_s) noexcept;
  Wrench wall_wrench(const ToolSample& sample) noexcept;

  LatestSlot<PatchPlayer>& patches_;
  SampleRing& samples_;
  Guard guard_;
  CouplingParameters coupling_;
  VirtualTool tool_;
  ToolPose device_;     ///< last usable reading
  Wrench environment_;  ///< the patch's wrench on the virtual tool
  PatchPlayer player_;
  bool has_player_ = false;
  double softening_ = 1;                       ///< scale of the player's force
  Micros stamp_{};                             ///< stamp of the patch in use, or later if it was renewed
  SampleHistory<ToolSample> recent_{kRecent};  ///< the ticks before this one
  Wrench fade_offset_;
  int fade_left_ = 0;
  double gain_ = 0;
  std::atomic<const PartWalls*> walls_{nullptr};
  std::atomic<std::int64_t> walls_until_us_{0};
  const PartWalls* met_ = nullptr;  ///< the newest that was not null
  WallTouches touches_;
  double wall_gain_ = 0;
  double wall_stiffness_ = 0;  ///< of its contacts in the last tick [N/m]
  HandsDamper damper_;
  GuidanceCoupling coupled_hand_;
  Vec3 guidance_ = Vec3::Zero();  ///< its force on the virtual tool [N]
  double guidance_mean_n_ = 0;    ///< norm of that, low-passed
  bool guidance_active_ = false;  ///< the coupling was not idle in the last tick
  double age_mean_us_ = 0, age_deviation_us_ = 0;
  std::atomic<std::int64_t> horizon_us_{0}, renewed_to_us_{Micros::min().count()}, server_until_us_{Micros::max().count()};
  std::atomic<std::uint32_t> late_ticks_{0};
  LatestSlot<PartnerTool> partners_;
  std::atomic<std::uint8_t> guidance_hand_{0};
  std::atomic<std::int64_t> guidance_reach_us_{0};
  std::atomic<double> guidance_force_n_{0};
  ButtonChanges buttons_;
  HapticCounts counts_;
};

}  // namespace palpate
