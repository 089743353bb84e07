// The haptic tick: newest patch -> player -> fade -> guard. Called once a millisecond by the one haptic thread.
//
// A new patch is replayed over the last few ticks that the network side had not seen, then takes over: the force step at the
// swap is measured and decays linearly to zero over 4 to 10 ticks, the more the larger it is beside what a hand does not notice,
// so that it changes the force by at most max(0.05 N, 5 % of the force) in 5 ms where 10 ticks are enough for that, and in any
// one tick where 25 are. A patch that is too old, or whose trust radius the tool has left, fades to zero over kFadeTicks; a patch
// that is good again fades in: what fades is the force that the device can show. Does not allocate, lock, log or throw.
//
// What a server says is believed within bounds of our own:
//     a patch is good for min(valid_for, kValidMost), and once the age a of patches in use is known, min(valid_for,
//     kValidBeyondAge + a), it is renewed for at most kRenewedMost after its stamp, and only while the server is there: until
//     server_until(), the last moment for which the network side vouches for it.
// Beyond any of these it fades like one that is too old. After a gap of more than Guard::kGapMaxS between ticks, and after
// restart(), force begins at zero, and a patch that has become too old meanwhile is forgotten.
//
// Where the device renders no more than a stiffness k_max and the patch has k (stiffness_of_port), its force is shown times k_max
// / k: a passive force times a constant is passive.
//
// With a virtual coupling (virtual_coupling.hpp; for devices with little damping) the patch, and the server through the samples,
// meets the virtual tool in place of the device, and the device feels the coupling: one tick later, and never stiffer than k_c.
#pragma once

#include <array>
#include <atomic>

#include "client/core/tool_hold.hpp"
#include "client/guard/guard.hpp"
#include "client/guard/virtual_coupling.hpp"
#include "common/base/latest_slot.hpp"
#include "common/base/spsc_ring.hpp"
#include "common/player/player.hpp"

namespace palpate {

inline constexpr std::size_t kSampleRing = 1024;
using SampleRing = SpscRing<ToolSample, kSampleRing>;

/// Whether a tool can be there at all.
inline bool in_world(const Vec3& position) noexcept {
  return position.allFinite() && position.cwiseAbs().maxCoeff() <= kWorldExtentM;
}

struct TickOutput {
  Vec3 force = Vec3::Zero();        ///< what the device shall render, after the guard [N]
  Vec3 model_force = Vec3::Zero();  ///< before it
  bool contact = false;
  bool has_patch = false;
  Micros patch_age{};           ///< now minus patch_stamp
  Micros patch_stamp{};         ///< of the patch in use, or the moment up to which the server renewed it
  bool swapped = false;         ///< a new patch took over in this tick
  double hand_over_step_n = 0;  ///< its force step before the cross-fade [N]
  double gain = 1;              ///< share of the patch's force that is displayed: less while it fades
  bool outlived = false;        ///< the patch in use is older than it is valid for
};

/// What bounds a server's word (above).
inline constexpr Micros kValidMost{5'000'000}, kValidBeyondAge{1'000'000}, kRenewedMost{1'000'000};

/// Stiffness that a patch shows to a hand at its port [N/m]: of attach the largest eigenvalue of K_p, all modes standing still;
/// of touch 1 / (n^T (R K^-1 R^T + c_static) n + 1 / k_c) along the normal n at the patch's point, all modes having followed,
/// those without stiffness aside. 0 for a constant patch.
double stiffness_of_port(const Patch& patch) noexcept;

struct HapticCounts {
  std::uint64_t ticks = 0, samples_dropped = 0, patches_used = 0, faded_ticks = 0;
  std::uint64_t softened = 0;  ///< patches whose force was shown weaker, being stiffer than the device can render
  double softened_most = 1;    ///< least share that was shown
  double hand_over_step_max_n = 0;
};

class HapticTick {
 public:
  /// `coupling` without stiffness: none.
  HapticTick(LatestSlot<PatchPlayer>& patches, SampleRing& samples, const GuardLimits& limits,
             const CouplingParameters& coupling = {});
  /// One tick. `sample.t` is the client's clock and grows by kTick (late ticks are skipped by the caller, never squeezed).
  /// A reading outside of the world is not played: the tool counts as standing still.
  TickOutput tick(const ToolSample& reading) noexcept;
  /// Before the first tick: what the device can render.
  void limit(const GuardLimits& limits) noexcept { guard_ = Guard(limits); }
  /// The device shows nothing: the force begins at zero. The haptic thread.
  void restart() noexcept;
  /// The server is there until `moment`, for all that the network side knows. Any thread, one at a time; for ever before the
  /// first call.
  void server_until(Micros moment) noexcept { server_until_us_.store(moment.count(), std::memory_order_release); }
  /// Age that patches reach before the next one takes over: smoothed mean and twice the mean deviation (as TCP does with round
  /// trips); 0 before the second patch. Any thread.
  Micros horizon() const noexcept { return Micros{horizon_us_.load(std::memory_order_relaxed)}; }
  /// The server says that the patch in use is as good as one stamped `stamp` would be. Any thread, one at a time.
  void renew_to(Micros stamp) noexcept { renewed_to_us_.store(stamp.count(), std::memory_order_relaxed); }
  /// How the tool is held and its buttons, which the haptic thread leaves for the network thread.
  ToolHold& hold() noexcept { return hold_; }
  /// The haptic thread woke late for this tick.
  void note_late() noexcept { late_ticks_.store(late_ticks() + 1, std::memory_order_relaxed); }
  /// How often it did. Any thread.
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
  double share_of(const Patch& patch) noexcept;
  void renew(Micros stamp, Micros now) noexcept;
  void note_ages(Micros next_stamp, Micros now) noexcept;
  void note_age(Micros age) noexcept;
  static int cross_fade_ticks(double step_n, double force_n) noexcept;
  void hand_over(PatchPlayer& next, const ToolSample& now) noexcept;
  Vec3 couple_to_tool(ToolSample& sample, double dt_s) noexcept;
  Vec3 patch_force(const ToolSample& sample, TickOutput& out) noexcept;

  LatestSlot<PatchPlayer>& patches_;
  SampleRing& samples_;
  Guard guard_;
  CouplingParameters coupling_;
  VirtualTool tool_;
  Vec3 device_ = Vec3::Zero();       ///< last usable reading [m]
  Vec3 environment_ = Vec3::Zero();  ///< the patch's force on the virtual tool [N]
  PatchPlayer player_;
  bool has_player_ = false;
  double softening_ = 1;  ///< share of the player's force that is shown
  Micros stamp_{};        ///< of the patch in use, or later: it was renewed
  std::array<ToolSample, kRecent> recent_{};
  std::uint64_t recent_count_ = 0;
  Vec3 fade_offset_ = Vec3::Zero();
  int fade_left_ = 0;
  double gain_ = 0;
  double age_mean_us_ = 0, age_deviation_us_ = 0;
  std::atomic<std::int64_t> horizon_us_{0}, renewed_to_us_{Micros::min().count()}, server_until_us_{Micros::max().count()};
  std::atomic<std::uint32_t> late_ticks_{0};
  ToolHold hold_;
  HapticCounts counts_;
};

}  // namespace palpate
