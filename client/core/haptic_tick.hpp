// The haptic tick: newest patch -> player -> fade -> guard. Called once a millisecond by the one haptic thread.
//
// A new patch is replayed over the last few ticks that the network side had not seen, then takes over: the force step at the
// swap is measured and decays linearly to zero over 4 to 10 ticks, the more the larger it is beside what a hand does not notice,
// so that it changes the force by at most max(0.05 N, 5 % of the force) in 5 ms where 10 ticks are enough for that, and in any
// one tick where 25 are. A patch that is too old, or whose trust radius the tool has left, fades to zero over kFadeTicks; a patch
// that is good again fades in: what fades is the force that the device can show. Does not allocate, lock, log or throw.
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
  Micros patch_stamp{};         ///< of the patch in use, or the moment up to which the server knows it to live on
  bool swapped = false;         ///< a new patch took over in this tick
  double hand_over_step_n = 0;  ///< its force step before the cross-fade [N]
  double gain = 1;              ///< share of the patch's force that is displayed: less while it fades
  bool outlived = false;        ///< the patch in use is older than it is valid for
};

struct HapticCounts {
  std::uint64_t ticks = 0, samples_dropped = 0, patches_used = 0, faded_ticks = 0;
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
  /// Age that patches reach before the next one takes over: smoothed mean and twice the mean deviation (as TCP does with round
  /// trips); 0 before the second patch. Any thread.
  Micros horizon() const noexcept { return Micros{horizon_us_.load(std::memory_order_relaxed)}; }
  /// The server says that the patch in use is as good as one stamped `stamp` would be. Any thread, one at a time.
  void live_on(Micros stamp) noexcept { lives_on_us_.store(stamp.count(), std::memory_order_relaxed); }
  /// How the tool is held and its buttons, which the haptic thread leaves for the network thread.
  ToolHold& hold() noexcept { return hold_; }
  /// The haptic thread woke late for this tick.
  void note_late() noexcept { late_ticks_.store(late_ticks() + 1, std::memory_order_relaxed); }
  /// How often it did. Any thread.
  std::uint32_t late_ticks() const noexcept { return late_ticks_.load(std::memory_order_relaxed); }
  const HapticCounts& counts() const { return counts_; }
  const GuardCounts& guard_counts() const { return guard_.counts(); }

 private:
  static constexpr int kRecent = 64;
  static constexpr int kCrossFadeLeast = 4, kCrossFadeUsual = 10, kCrossFadeMost = 25;
  static constexpr int kFadeTicks = 50;

  Micros lives_on() const noexcept { return Micros{lives_on_us_.load(std::memory_order_relaxed)}; }
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
  Micros stamp_{};  ///< of the patch in use, or later: it lives on
  std::array<ToolSample, kRecent> recent_{};
  std::uint64_t recent_count_ = 0;
  Vec3 fade_offset_ = Vec3::Zero();
  int fade_left_ = 0;
  double gain_ = 0;
  double age_mean_us_ = 0, age_deviation_us_ = 0;
  std::atomic<std::int64_t> horizon_us_{0}, lives_on_us_{Micros::min().count()};
  std::atomic<std::uint32_t> late_ticks_{0};
  ToolHold hold_;
  HapticCounts counts_;
};

}  // namespace palpate
