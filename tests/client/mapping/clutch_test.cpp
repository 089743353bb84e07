// Clutch, dead-man switch and tool weight: no step of force or position, for any buttons and motion of the device.
#include <catch2/catch.hpp>
#include <cmath>

#include "client/device/sim_phantom.hpp"
#include "scripted_device.hpp"
#include "tests/support/realtime_guard.hpp"

using namespace palpate;
using palpate::test::Bench;
using palpate::test::kMs;
using palpate::test::kWholeFade;

namespace {

const Vec3 kForce(0, 0, 3);
/// Largest change per tick of a force that fades out or in: 15/8 of it over the time of the fade.
const double kOutStepN = 15.0 / 8 * kForce.norm() * 1e-3 / kFadeOutS, kInStepN = 15.0 / 8 * kForce.norm() * 1e-3 / kFadeInS;

WorkspaceMapping with_clutch(double scale = 1) {
  WorkspaceMapping mapping;
  mapping.scale = scale;
  mapping.clutch_button = 0;
  return mapping;
}

/// The hand moves 0.1 mm per tick along x.
void move(int, DeviceReading& reading) { reading.position.x() += 1e-4; }
void press(DeviceReading& reading, std::uint32_t buttons) { reading.buttons = buttons; }

}  // namespace

TEST_CASE("Force begins at zero and fades in without a step") {
  Bench bench(with_clutch());
  bench.run(kWholeFade, kForce);
  CHECK(bench.forces.front().norm() <= kInStepN);
  CHECK(bench.forces.back().isApprox(kForce));
  CHECK(bench.force_step_max_n() <= kInStepN + 1e-12);
}

TEST_CASE(
    "A button closes jaws evenly while it is held and opens them else, and without one the gripper's opening is passed on") {
  WorkspaceMapping mapping;
  mapping.jaws_button = 1;
  Bench bench(mapping), own({});
  CHECK(bench.mapped.caps().has_opening);
  CHECK_FALSE(own.mapped.caps().has_opening);
  const auto opening = [](Bench& at) { return at.mapped.read(at.now += kMs).opening; };
  CHECK(opening(bench) == 1);
  press(bench.device.reading, 2);
  for (int ms = 1; ms <= 1000; ++ms) CHECK(opening(bench) == Approx(std::max(0.0, 1 - 1e-3 * kJawsButton1S * ms)).margin(1e-9));
  press(bench.device.reading, 1);
  for (int ms = 1; ms <= 100; ++ms) CHECK(opening(bench) == Approx(1e-3 * kJawsButton1S * ms));
  own.device.reading.opening = 0.3;
  CHECK(opening(own) == 0.3);
}

TEST_CASE("A hand that waits feels nothing, wherever it moves, until it is told to start, and then no step") {
  Bench bench({});
  bench.mapped.wait_for_start();
  bench.run(2 * kWholeFade, kForce, move);
  for (const Vec3& force : bench.forces) CHECK(force.norm() == 0);
  CHECK(bench.tools.back().x() - bench.tools.front().x() == Approx(1e-4 * (2 * kWholeFade - 1)).epsilon(1e-9));
  bench.mapped.start(bench.now);
  bench.run(kWholeFade, kForce, move);
  CHECK(bench.force_step_max_n() <= kInStepN + 1e-12);
  CHECK(bench.forces.back().isApprox(kForce));
}

TEST_CASE("While the clutch is held the tool stays, the hand is free, and goes on from there without a step") {
  for (const double scale : {1.0, 3.0}) {
    Bench bench(with_clutch(scale));
    bench.run(kWholeFade, kForce, move);
    const Vec3 stayed = bench.tools.back();
    press(bench.device.reading, 1);
    bench.run(500, kForce, move);  // 50 mm
    CHECK(bench.tools.back() == stayed);
    CHECK(bench.forces.back().norm() == 0);
    CHECK(bench.mapped.read(bench.now).share == 0);
    const double out_n = bench.force_step_max_n();
    press(bench.device.reading, 0);
    bench.run(kWholeFade, kForce, move);
    CHECK(out_n <= kOutStepN + 1e-12);
    CHECK(out_n > 0.5 * kOutStepN);
    CHECK(bench.force_step_max_n() <= kOutStepN + 1e-12);
    CHECK(bench.tool_step_max_m() <= scale * 1e-4 + 1e-12);
    CHECK(bench.forces.back().isApprox(kForce));
    // The tool followed the hand except in the 500 ticks of the clutch and the one in which it closed again.
    CHECK(bench.tools.back().x() - stayed.x() == Approx(scale * 1e-4 * (kWholeFade - 1)).epsilon(1e-9));
  }
}

TEST_CASE("A button that bounces makes no step") {
  Bench bench(with_clutch());
  bench.run(kWholeFade, kForce);
  bench.run(600, kForce, [](int k, DeviceReading& reading) {
    move(k, reading);
    press(reading, k / (1 + k / 60) % 2 == 0 ? 1 : 0);
  });
  CHECK(bench.force_step_max_n() <= kOutStepN + 1e-12);
  CHECK(bench.tool_step_max_m() <= 1e-4 + 1e-12);
}

TEST_CASE("Without the dead-man button there is no force, not even against the weight, and the tool stays") {
  WorkspaceMapping mapping;
  mapping.dead_man_button = 1;
  mapping.tool_weight_n = Vec3(0, 0, -0.4);
  Bench bench(mapping);
  bench.run(300, kForce, move);
  for (const Vec3& force : bench.forces) CHECK(force.norm() == 0);
  CHECK(bench.tools.back() == bench.tools.front());
  press(bench.device.reading, 2);
  bench.run(kWholeFade, kForce, move);
  CHECK(bench.forces.back().isApprox(kForce + Vec3(0, 0, 0.4)));
  const Vec3 stayed = bench.tools.back();
  press(bench.device.reading, 0);
  // The hand has let go, and the device falls.
  bench.run(101, kForce, [](int, DeviceReading& reading) { reading.position.z() -= 1e-3; });
  CHECK(bench.forces.back().norm() == 0);
  CHECK(bench.tools.back() == stayed);
  CHECK(bench.force_step_max_n() <= 3.4 / 3 * kOutStepN + 1e-12);
}

TEST_CASE("The clutch leaves the weight of the tool carried") {
  WorkspaceMapping mapping = with_clutch();
  mapping.rotation_deg = Vec3(0, 90, 0);  // the weight belongs to the device, wherever it is in the scene
  mapping.tool_weight_n = Vec3(0.1, 0, -0.4);
  Bench bench(mapping);
  bench.run(kWholeFade, Vec3::Zero());
  CHECK(bench.forces.back().isApprox(Vec3(-0.1, 0, 0.4)));
  press(bench.device.reading, 1);
  bench.run(kWholeFade, kForce);
  CHECK(bench.forces.back().isApprox(Vec3(-0.1, 0, 0.4)));
}

TEST_CASE("A device that was away comes back without force, and with a clutch without moving the tool") {
  for (const bool clutch : {false, true}) {
    Bench bench(clutch ? with_clutch() : WorkspaceMapping{});
    bench.run(kWholeFade, kForce, move);
    const Vec3 stayed = bench.tools.back(), from = bench.device.reading.position;
    bench.device.reading.state = DeviceState::gone;
    bench.device.reading.position = Vec3(1, 1, 1);
    bench.run(10, kForce);
    CHECK(bench.forces.back().norm() == 0);
    CHECK(bench.tools.back() == stayed);
    bench.device.reading.state = DeviceState::ok;
    bench.run(1, kForce);
    CHECK(bench.forces.back().norm() <= kInStepN);
    CHECK(bench.tools.back().isApprox(clutch ? stayed : Vec3(stayed + Vec3(1, 1, 1) - from), 1e-12));
  }
}

TEST_CASE("A loop that slept for three seconds goes on fading where it was") {
  Bench bench(with_clutch());
  bench.run(100, kForce);
  bench.now += Micros{3'000'000};
  bench.run(100, kForce);
  CHECK(bench.force_step_max_n() <= kInStepN + 1e-12);
}

TEST_CASE("Nothing above the device's peak force is written, whatever was asked for") {
  Bench bench(WorkspaceMapping{});
  bench.device.device_caps.force_max_n = 8;
  bench.run(kWholeFade, Vec3(60, 0, 80));
  CHECK(bench.forces.back().isApprox(Vec3(4.8, 0, 6.4)));
}

TEST_CASE("What is no number becomes no force, and what is said to be none of the device's business passes through") {
  WorkspaceMapping mapping;
  mapping.tool_weight_n = Vec3(0, 0, -0.4);
  Bench bench(mapping);
  bench.run(kWholeFade, kForce);
  bench.run(1, Vec3(NAN, 0, INFINITY));
  CHECK(bench.forces.back().isApprox(Vec3(0, 0, 0.4)));
  bench.device.reading.position = Vec3(NAN, 0, 0);
  CHECK_FALSE(bench.mapped.read(bench.now += kMs).position.allFinite());
  bench.mapped.halt();
  CHECK(bench.device.halted);
  bench.mapped.resume();
  CHECK_FALSE(bench.device.halted);
  CHECK(bench.mapped.share() == 0);
}

namespace {

/// Largest change of the force per tick while a hand presses onto a wall at z = 0 in the scene, moves sideways and comes back.
double force_step_on_wall(const WorkspaceMapping& mapping, std::uint32_t pressed) {
  constexpr double kWallNM = 400;
  std::vector<MotionPoint> points{
      {0, {0, 0, 0.01}}, {1, {0, 0, -0.01}}, {2, {0.03, 0, -0.01}}, {3, {0.03, 0, -0.012}}, {4, {0, 0, 0.02}}};
  MotionHolds holds{{}, {0, 0, pressed, 0, 0}, {}};
  SimPhantomOptions options;
  options.hand = *hand_from_name("firm");
  options.force_step_n = options.position_step_m = options.tremor_m = 0;
  SimPhantom phantom(Motion(points, holds), options);
  WorkspaceMapping placed = mapping;
  placed.centre_m = Vec3::Zero();
  MappedDevice mapped(phantom, placed, {});
  Vec3 before = Vec3::Zero();
  double step_n = 0;
  for (Micros t = kMs; t < Micros{4'500'000}; t += kMs) {
    const double z = mapped.read(t).position.z();
    mapped.write(Vec3(0, 0, kWallNM * std::max(0.0, -z)));
    step_n = std::max(step_n, (phantom.force() - before).norm());
    before = phantom.force();
  }
  return step_n;
}

}  // namespace

TEST_CASE("A hand on a wall that works its clutch feels no larger change of force in a tick than the fade adds") {
  WorkspaceMapping mapping = with_clutch();
  const double without_n = force_step_on_wall(WorkspaceMapping{}, 0), with_n = force_step_on_wall(mapping, 1);
  CAPTURE(without_n, with_n);
  CHECK(with_n <= without_n + kFadeSlewMax1S * 1e-3 * 5);  // at most 5 N on the wall
}

TEST_CASE("Reading and writing neither allocates nor locks nor throws, over a whole cycle of the buttons") {
  WorkspaceMapping mapping = with_clutch(2);
  mapping.dead_man_button = 1;
  test::ScriptedDevice device;
  MappedDevice mapped(device, mapping, {});
  Micros now{};
  test::RealtimeGuard guard;
  for (int k = 0; k < 2000; ++k) {
    device.reading.buttons = static_cast<std::uint32_t>(k / 300 % 4);
    device.reading.state = k / 500 == 2 ? DeviceState::fault : DeviceState::ok;
    mapped.read(now += kMs);
    mapped.write(kForce);
  }
  mapped.stop();
  const auto seen = guard.end();
  if (test::RealtimeGuard::active()) CHECK(seen.none());
}
