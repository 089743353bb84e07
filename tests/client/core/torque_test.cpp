// Torque through the tick: a device that feels it, fades and scales that it shares with the force.
#include <catch2/catch.hpp>
#include <cmath>

#include "client/device/sim_phantom.hpp"
#include "client/io/device_limits.hpp"
#include "client/io/reading_check.hpp"
#include "common/base/rotation_vector.hpp"
#include "tests/client/core/ticking_hand.hpp"
#include "tests/support/floor_patch.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kBarHalfM = 0.02, kBarRadiusM = 0.004, kBarContact = 400;

/// A bar of two spheres along x over a frictionless floor, which it touches from above; 1 s after kEpoch's stamp.
Patch bar_over_floor() {
  Patch p = floor_patch(0);
  const double floor_m = p.surface.vertices[0].position.z();
  p.stamp = kEpoch;
  p.c_static.setZero();
  p.contact_stiffness_n_m = kBarContact;
  p.trust_radius_m = 1;
  p.valid_for = Micros{60'000'000};
  p.tool = Vec3(0, 0, floor_m);
  p.turn = Rotation(Rotation::Identity());
  p.sphere = {Vec3(-kBarHalfM, 0, kBarRadiusM), kBarRadiusM};
  p.others.count = p.others.own = 1;
  OtherContact& other = p.others.of[0];
  other.sphere = {Vec3(kBarHalfM, 0, kBarRadiusM), kBarRadiusM};
  other.gap = Vec3::Zero();
  other.normal = Vec3::UnitZ();
  other.rows = p.surface.vertices[0].rows;
  p.touching = false;
  return p;
}

/// A tick with the limits of a device.
struct Felt {
  std::unique_ptr<LatestSlot<PatchPlayer>> slot = std::make_unique<LatestSlot<PatchPlayer>>();
  std::unique_ptr<SampleRing> ring = std::make_unique<SampleRing>();
  HapticTick haptic;
  explicit Felt(const GuardLimits& limits) : haptic(*slot, *ring, limits) {}
  void give(const Patch& patch) {
    slot->back() = PatchPlayer(patch);
    slot->publish();
  }
};

Patch with_torque(const Vec3& force, const Vec3& torque, std::uint32_t seq, Micros stamp) {
  Patch p = constant(force, seq, stamp);
  p.turn = Rotation(Rotation::Identity());
  p.torque = torque;
  return p;
}

GuardLimits turning_limits() {
  GuardLimits limits;
  limits.renders_torque = true;
  return limits;
}

}  // namespace

TEST_CASE("A bar that a hand holds askew and presses on a floor is turned by it, and comes to rest there undamped") {
  const Patch patch = bar_over_floor();
  // The hand means to hold the bar tilted about y by 0.15 rad, 4 mm below the surface.
  SimPhantomOptions hand;
  hand.tremor_m = hand.position_step_m = hand.force_step_n = 0;
  hand.hand = *hand_from_name("reference");
  hand.wrist = SimWrist{.torque_step_nm = 0};
  const Vec3 wish = patch.tool - Vec3(0, 0, 0.004);
  MotionHolds holds;
  const Eigen::Quaterniond tilted(Eigen::AngleAxisd(0.15, Vec3::UnitY()));
  for (int k = 0; k < 3; ++k) holds.orientations.emplace_back(tilted);
  SimPhantom device(Motion({{0.0, wish + Vec3(0, 0, 0.01)}, {1.0, wish}, {5.0, wish}}, holds, "askew"), hand);
  Felt felt(limits_of(device.caps(), PassivityMode::on));
  felt.give(patch);
  TickOutput out;
  for (int ms = 1; ms <= 4000; ++ms) {
    const DeviceReading reading = device.read(ms * kTick);
    out = felt.haptic.tick({kEpoch + ms * kTick, reading.position, Rotation(reading.orientation)});
    device.write(out.wrench());
  }
  CHECK(device.spin().norm() < 1e-6);
  CHECK(device.velocity().norm() < 1e-6);
  // At rest hand and floor balance: each end of the bar is a spring. Unknown: height z and tilt a; small angles do not suffice.
  const double height = device.position().z() - patch.tool.z();
  const double angle = rotation_vector(device.turn()).y();
  const auto push = [&](double side) {
    const Vec3 centre = device.turn() * Vec3(side * kBarHalfM, 0, kBarRadiusM);
    return kBarContact * std::max(0.0, -(height + centre.z() - kBarRadiusM));
  };
  const double force = push(-1) + push(1);
  double torque = 0;
  for (const double side : {-1.0, 1.0}) torque -= (device.turn() * Vec3(side * kBarHalfM, 0, kBarRadiusM)).x() * push(side);
  CHECK(force == Approx(hand.hand.stiffness_n_m * (height + 0.004)).epsilon(1e-4));
  CHECK(torque == Approx(hand.wrist->stiffness_nm_rad * (angle - 0.15)).epsilon(1e-4));
  CHECK(angle < 0.13);  // turned towards the floor
  CHECK(out.torque.y() == Approx(torque).epsilon(1e-6));
  CHECK(felt.haptic.guard_counts().damped == 0);
}

TEST_CASE("A torque fades with its force: at a hand-over, and when its patch is too old") {
  Felt felt(turning_limits());
  int ms = 0;
  const auto tick = [&] { return felt.haptic.tick({kEpoch + ++ms * kTick, Vec3::Zero(), Rotation(Rotation::Identity())}); };
  felt.give(with_torque(Vec3(1, 0, 0), Vec3(0, 0.02, 0), 1, kEpoch));
  for (int k = 0; k < 100; ++k) tick();
  CHECK(tick().torque == Vec3(0, 0.02, 0));
  Patch next = with_torque(Vec3(3, 0, 0), Vec3(0, 0.06, 0), 2, kEpoch + ms * kTick);
  next.valid_for = Micros{60'000};
  felt.give(next);
  for (int k = 0; k < 100; ++k) {
    const TickOutput out = tick();
    CHECK(out.torque.y() == Approx(0.02 * out.force.x()).margin(1e-15));  // both patches have the same arm
  }
  CHECK(tick().force.x() < 3);
  for (int k = 0; k < 60; ++k) tick();
  CHECK(tick().torque.norm() == 0);
}

TEST_CASE("The torsional stiffness of a bar on a floor is that of two springs on its arms, and a softer device gets less") {
  Patch patch = bar_over_floor();
  const double torsion = 2 * kBarContact * kBarHalfM * kBarHalfM;
  CHECK(torsion_of_port(patch) == Approx(torsion));
  CHECK(stiffness_of_port(patch) == Approx(2 * kBarContact));
  Patch point = patch;
  point.turn.reset();
  CHECK(torsion_of_port(point) == 0);
  GuardLimits limits = turning_limits();
  Felt whole(limits);
  limits.torsion_stiffness_max_nm_rad = torsion / 4;
  Felt soft(limits);
  for (Felt* felt : {&whole, &soft}) felt->give(patch);
  for (int ms = 1; ms <= 100; ++ms) {
    const ToolSample sample{kEpoch + ms * kTick, patch.tool - Vec3(0, 0, 2e-5 * ms), rotation_by(Vec3(0, 5e-4 * ms, 0))};
    const TickOutput all = whole.haptic.tick(sample), part = soft.haptic.tick(sample);
    CHECK((part.force - 0.25 * all.force).norm() < 1e-12);
    CHECK((part.torque - 0.25 * all.torque).norm() < 1e-15);
  }
  CHECK(soft.haptic.counts().softened == 1);
}

TEST_CASE("A reading that turns further than its device can is rejected where a torque is rendered") {
  SimPhantomOptions options;
  for (const bool turns : {true, false}) {
    if (turns) options.wrist = SimWrist{};
    if (!turns) options.wrist.reset();
    ReadingCheck check(SimPhantom(Motion::rest(Vec3::Zero(), 1), options).caps());
    const auto look = [&](int ms, double rad) { return check.look({Vec3::Zero(), rotation_by(Vec3(0, 0, rad))}, ms * kTick, 0); };
    CHECK(look(1, 0) == ReadingFault::none);
    CHECK(look(2, 0.055) == ReadingFault::none);  // 30 rad/s twice over allow 0.06
    CHECK(look(3, 0.12) == (turns ? ReadingFault::jumped : ReadingFault::none));
  }
}

TEST_CASE("A device that renders a torque and does not state all of its limits is refused, with what is missing") {
  SimPhantomOptions options;
  options.wrist = SimWrist{};
  const SimPhantom device(Motion::rest(Vec3::Zero(), 1), options);
  CHECK(limits_of(device.caps(), PassivityMode::on).torque_max_nm == 0.3);
  const auto refusal = [&](auto change) {
    DeviceCaps caps = device.caps();
    change(caps);
    try {
      limits_of(caps, PassivityMode::on);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  CHECK_THAT(refusal([](DeviceCaps& c) { c.torque_max_nm = 0; }), Catch::Contains("peak torque (torque_max_nm)"));
  CHECK_THAT(refusal([](DeviceCaps& c) { c.torque_continuous_nm = 0; }), Catch::Contains("continuous torque"));
  CHECK_THAT(refusal([](DeviceCaps& c) { c.torque_slew_max_nm_s = 0; }), Catch::Contains("change of torque"));
  CHECK_THAT(refusal([](DeviceCaps& c) { c.spin_max_rad_s = 0; }), Catch::Contains("rate of rotation"));
  CHECK_THAT(refusal([](DeviceCaps& c) { c.has_orientation = false; }), Catch::Contains("without orientation"));
  CHECK(refusal([](DeviceCaps&) {}) == "none");
}
