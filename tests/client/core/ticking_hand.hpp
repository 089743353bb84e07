// A haptic tick with its own clock and slot, and patches of constant force.
#pragma once

#include <memory>

#include "client/core/haptic_tick.hpp"
#include "tests/support/patches.hpp"

namespace palpate::test {

inline constexpr Micros kEpoch{1'000'000};

struct Hand {
  std::unique_ptr<LatestSlot<PatchPlayer>> slot = std::make_unique<LatestSlot<PatchPlayer>>();
  std::unique_ptr<SampleRing> ring = std::make_unique<SampleRing>();
  explicit Hand(PassivityMode passivity = PassivityMode::off, double force_max_n = 0)
      : haptic(*slot, *ring, GuardLimits{force_max_n, 0, passivity}) {}
  HapticTick haptic;
  int ms = 0;

  Micros now() const { return kEpoch + ms * kTick; }
  void give(const Patch& patch) {
    slot->back() = PatchPlayer(patch);
    slot->publish();
  }
  TickOutput tick(const Vec3& tool = Vec3::Zero()) {
    ++ms;
    return haptic.tick({now(), tool});
  }
  TickOutput ticks(int count, const Vec3& tool = Vec3::Zero()) {
    TickOutput out;
    for (int k = 0; k < count; ++k) out = tick(tool);
    return out;
  }
};

inline Patch constant(const Vec3& force, std::uint32_t seq, Micros stamp, Micros valid_for = Micros{10'000'000}) {
  Patch p;
  p.constant = true;
  p.seq = seq;
  p.stamp = stamp;
  p.force = force;
  p.valid_for = valid_for;
  p.trust_radius_m = 0.05;
  return p;
}

}  // namespace palpate::test
