// The haptic tick, in all its cases, allocates, locks and throws nothing.
#include "client/core/haptic_tick.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "client/device/sim_phantom.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/patches.hpp"
#include "tests/support/realtime_guard.hpp"

using palpate::kTick;
using palpate::Micros;
using palpate::Motion;
using palpate::Patch;
using palpate::PatchPlayer;
using palpate::TickOutput;
using palpate::Vec3;
using palpate::test::RealtimeFaults;

namespace {

constexpr int kTicks = 2000, kPatchEvery = 50, kModes = palpate::kMaxModes;
constexpr Micros kEpoch{1'000'000};

/// Above the plane, into it by 8 mm, along it, out again.
Motion press_and_stroke() {
  std::vector<palpate::MotionPoint> points;
  for (int i = 0; i <= kTicks; ++i) {
    const double t = i * 1e-3;
    points.push_back({t, Vec3(0.01 * std::sin(4 * t), 0.005 * std::sin(7 * t), 0.003 - 0.011 * std::sin(M_PI * t / 2))});
  }
  return Motion(std::move(points));
}

struct Run {
  RealtimeFaults faults;
  palpate::HapticCounts counts;
  palpate::GuardCounts guard;
  int contact_ticks = 0;
  double force_max_n = 0;
};

/// A hand on a simulated Phantom; a new patch 30 ms old every 50 ticks. The patches are compiled beforehand, as on the network
/// side.
Run play(const std::function<Patch(std::uint32_t, Micros)>& patch_at, Micros valid_for,
         const std::function<palpate::NonlinearTerms(const Patch&)>& terms_of = {}) {
  std::vector<PatchPlayer> players;
  for (int tick = 0; tick < kTicks; tick += kPatchEvery) {
    const auto stamp = kEpoch + tick * kTick - Micros{30'000};
    Patch patch = patch_at(static_cast<std::uint32_t>(tick / kPatchEvery + 1), stamp);
    patch.valid_for = valid_for;
    REQUIRE(palpate::check(patch) == palpate::PatchFault::none);
    players.emplace_back(patch, terms_of ? terms_of(patch) : palpate::NonlinearTerms{});
  }
  const auto slot = std::make_unique<palpate::LatestSlot<PatchPlayer>>();
  const auto samples = std::make_unique<palpate::SampleRing>();
  palpate::HapticTick haptic(*slot, *samples, {8.5, 500, palpate::PassivityMode::on});
  palpate::SimPhantom phantom(press_and_stroke(), {});
  palpate::Device& device = phantom;

  Run run;
  palpate::test::RealtimeGuard guard;
  for (int tick = 0; tick < kTicks; ++tick) {
    if (tick % kPatchEvery == 0) {
      slot->back() = players[static_cast<std::size_t>(tick / kPatchEvery)];
      slot->publish();
    }
    const Micros now = kEpoch + tick * kTick;
    const TickOutput out = haptic.tick({now, device.read(now).position});
    device.write(out.force);
    run.contact_ticks += out.contact;
    run.force_max_n = std::max(run.force_max_n, out.force.norm());
  }
  device.stop();
  run.faults = guard.end();
  run.counts = haptic.counts();
  run.guard = haptic.guard_counts();
  return run;
}

void check_clean(const RealtimeFaults& faults) {
  CHECK(faults.allocations == 0);
  CHECK(faults.frees == 0);
  CHECK(faults.locks == 0);
  CHECK(faults.throws == 0);
}

}  // namespace

TEST_CASE("A grasp is felt through fresh patches without allocation, lock or exception", "[realtime]") {
  const Run run = play([](auto seq, auto stamp) { return palpate::test::attach_patch(kModes, seq, stamp); }, Micros{500'000});
  check_clean(run.faults);
  CHECK(run.counts.patches_used == kTicks / kPatchEvery);
  CHECK(run.force_max_n > 0.05);
}

TEST_CASE("A grasp with springs or tetrahedra for terms is felt without allocation, lock or exception", "[realtime]") {
  const auto patch_at = [](auto seq, auto stamp) { return palpate::test::attach_patch(kModes, seq, stamp); };
  const Run linear = play(patch_at, Micros{500'000});
  for (const auto& terms_of : {palpate::test::spring_terms, palpate::test::solid_terms}) {
    const Run nonlinear = play(patch_at, Micros{500'000}, terms_of);
    check_clean(nonlinear.faults);
    CHECK(nonlinear.counts.patches_used == kTicks / kPatchEvery);
    CHECK(nonlinear.force_max_n > 0.05);
    CHECK(nonlinear.force_max_n != linear.force_max_n);
  }
}

TEST_CASE("A touch with onset, stroke and release is felt without allocation, lock or exception, with terms or without",
          "[realtime]") {
  const auto patch_at = [](auto seq, auto stamp) { return palpate::test::touch_patch(kModes, seq, stamp); };
  const auto check = [](const Run& run) {
    check_clean(run.faults);
    CHECK(run.contact_ticks > kTicks / 4);
    CHECK(run.contact_ticks < kTicks);
    CHECK(run.force_max_n > 0.05);
  };
  const Run linear = play(patch_at, Micros{500'000});
  check(linear);
  for (const auto& terms_of : {palpate::test::spring_terms, palpate::test::solid_terms}) {
    const Run nonlinear = play(patch_at, Micros{500'000}, terms_of);
    check(nonlinear);
    CHECK(nonlinear.force_max_n != linear.force_max_n);
  }
}

TEST_CASE("Patches that grow too old fade without allocation, lock or exception", "[realtime]") {
  const Run run = play([](auto seq, auto stamp) { return palpate::test::attach_patch(kModes, seq, stamp); }, Micros{60'000});
  check_clean(run.faults);
  CHECK(run.counts.faded_ticks > kTicks / 10);
}

TEST_CASE("No patch and a full sample ring are no force and a count, without allocation, lock or exception", "[realtime]") {
  const auto slot = std::make_unique<palpate::LatestSlot<PatchPlayer>>();
  const auto samples = std::make_unique<palpate::SampleRing>();
  palpate::HapticTick haptic(*slot, *samples, {});
  double force_max_n = 0;
  palpate::test::RealtimeGuard guard;
  for (int tick = 0; tick < kTicks; ++tick) {
    const TickOutput out = haptic.tick({kEpoch + tick * kTick, Vec3(0, 0, tick * 1e-6)});
    force_max_n = std::max(force_max_n, out.force.norm());
  }
  check_clean(guard.end());
  CHECK(force_max_n == 0);
  CHECK(haptic.counts().samples_dropped == kTicks - palpate::kSampleRing);
}

TEST_CASE("A tool slides over a rigid part without allocation, lock or exception", "[realtime]") {
  const palpate::TriangleMesh box = palpate::test::box_mesh(Vec3(-0.1, -0.1, -0.05), Vec3(0.1, 0.1, 0));
  const double friction = 0.3;
  const palpate::PartWalls walls(std::span(&box, 1), std::span(&friction, 1), {}, 800);
  const auto slot = std::make_unique<palpate::LatestSlot<PatchPlayer>>();
  const auto samples = std::make_unique<palpate::SampleRing>();
  palpate::HapticTick haptic(*slot, *samples, {8.5, 500, palpate::PassivityMode::on});
  double force_max_n = 0;
  palpate::test::RealtimeGuard guard;
  haptic.meet(&walls, Micros::max());
  for (int tick = 0; tick < kTicks; ++tick) {
    const double s = tick * 0.005;
    force_max_n = std::max(
        force_max_n, haptic.tick({kEpoch + tick * kTick, Vec3(0.02 * std::sin(s), 0, 0.004 * std::cos(2 * s))}).force.norm());
  }
  check_clean(guard.end());
  CHECK(force_max_n > 0.5);
}

TEST_CASE("A tool that a partner guides is felt without allocation, lock or exception, also where the partner falls silent",
          "[realtime]") {
  const auto slot = std::make_unique<palpate::LatestSlot<PatchPlayer>>();
  const auto samples = std::make_unique<palpate::SampleRing>();
  palpate::HapticTick haptic(*slot, *samples, {8.5, 500, palpate::PassivityMode::on});
  double force_max_n = 0, last_n = 0;
  palpate::test::RealtimeGuard guard;
  for (int tick = 0; tick < kTicks; ++tick) {
    const Micros now = kEpoch + tick * kTick;
    if (tick % 8 == 0 && tick < kTicks - 300)
      haptic.hear({now - Micros{40'000}, Vec3(0.01, 0.002 * std::sin(tick * 0.01), 0), Micros{60'000}, true});
    last_n = haptic.tick({now, Vec3::Zero()}).force.norm();
    force_max_n = std::max(force_max_n, last_n);
  }
  check_clean(guard.end());
  CHECK(force_max_n > 1);
  CHECK(last_n == 0);
  CHECK(haptic.counts().holds == 1);
  CHECK(haptic.counts().guidance_max_n == Approx(force_max_n));
}
