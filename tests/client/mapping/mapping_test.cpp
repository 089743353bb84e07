// Positions, forces and limits of a mapped device, against the equations of workspace_mapping.hpp evaluated by hand.
#include <catch2/catch.hpp>
#include <random>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/base/rotation_vector.hpp"
#include "scripted_device.hpp"

using namespace palpate;
using palpate::test::Bench;
using palpate::test::kMs;
using palpate::test::kWholeFade;
using palpate::test::ScriptedDevice;

namespace {

/// Mapping of scale 2 with a quarter turn about z: x of the device is y of the scene.
WorkspaceMapping quarter() {
  WorkspaceMapping mapping;
  mapping.scale = 2;
  mapping.rotation_deg = Vec3(0, 0, 90);
  mapping.centre_m = Vec3(0.01, 0, 0);
  return mapping;
}

std::string fault_of(const WorkspaceMapping& mapping, const DeviceCaps& caps) {
  try {
    mapped_caps(caps, mapping, Vec3::Zero(), std::nullopt, "w.json");
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("A point of the device comes to home plus offset plus the turned and scaled way from the centre") {
  WorkspaceMapping mapping = quarter();
  mapping.offset_m = Vec3(0, 0, 0.5);
  Bench bench(mapping, {Vec3(1, 2, 3), false});
  bench.device.reading.position = Vec3(0.01 + 0.1, 0.2, 0.3);
  bench.run(1, Vec3::Zero());
  CHECK(bench.tools.back().isApprox(Vec3(1 - 0.4, 2 + 0.2, 3 + 0.5 + 0.6), 1e-12));
}

TEST_CASE("The force turns back with the device, in newtons, and the orientation turns with the tool") {
  Bench bench(quarter());
  // The shaft points along x of the device, which is y of the scene.
  bench.device.reading.orientation = shortest_rotation(Vec3::UnitZ(), Vec3::UnitX());
  bench.run(kWholeFade, Vec3(0, 3, 1));
  CHECK(bench.forces.back().isApprox(Vec3(3, 0, 1), 1e-12));
  const DeviceReading seen = bench.mapped.read(bench.now += kMs);
  CHECK((seen.orientation * Vec3::UnitZ()).isApprox(Vec3::UnitY(), 1e-12));
}

TEST_CASE("The hand takes the power of the tool times force scale over scale, whatever moves where") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vec = [&] { return Vec3(unit(random), unit(random), unit(random)); };
  WorkspaceMapping mapping;
  mapping.scale = 2.5;
  mapping.force_scale = 0.7;
  mapping.rotation_deg = Vec3(20, -35, 110);
  Bench bench(mapping);
  bench.run(kWholeFade, Vec3::Zero());
  for (int k = 0; k < 50; ++k) {
    const Vec3 from = bench.device.reading.position, at = bench.tools.back(), dx = 1e-3 * vec(), force = 4 * vec();
    bench.run(1, force, [&](int, DeviceReading& reading) { reading.position = from + dx; });
    const double hand_j = bench.forces.back().dot(dx), tool_j = force.dot(bench.tools.back() - at);
    CHECK(hand_j == Approx(0.7 / 2.5 * tool_j).margin(1e-15));
  }
}

TEST_CASE("What limits the device limits the scene: forces less the weight, stiffness and speed by the scales, the box turned") {
  DeviceCaps caps;
  caps.force_max_n = 8;
  caps.force_continuous_n = 2;
  caps.slew_max_n_s = 2000;
  caps.stiffness_max_n_m = 800;
  caps.velocity_max_m_s = 1.5;
  caps.workspace = {Vec3(-0.1, -0.2, -0.3), Vec3(0.1, 0.2, 0.4)};
  WorkspaceMapping mapping = quarter();
  mapping.force_scale = 0.5;
  mapping.tool_weight_n = Vec3(0, 0, -0.5);
  const DeviceCaps mapped = mapped_caps(caps, mapping, Vec3(1, 1, 1), Vec3::Zero(), "w.json");
  CHECK(mapped.force_max_n == Approx(15));
  CHECK(mapped.force_continuous_n == Approx(3));
  CHECK(mapped.slew_max_n_s == Approx(4000));
  CHECK(mapped.stiffness_max_n_m == Approx(800));  // 800 / (0.5 * 2)
  CHECK(mapped.velocity_max_m_s == Approx(3));
  CHECK(mapped.workspace.min().isApprox(Vec3(1 - 0.4, 1 - 0.2, 1 - 0.6), 1e-12));
  CHECK(mapped.workspace.max().isApprox(Vec3(1 + 0.4, 1 + 0.2, 1 + 0.8), 1e-12));
}

TEST_CASE("No force in the scene that the mapped limits allow is more than the device's peak, fading or not") {
  WorkspaceMapping mapping;
  mapping.force_scale = 2;
  mapping.clutch_button = 0;
  mapping.tool_weight_n = Vec3(0, 0, -0.6);
  ScriptedDevice device;
  device.device_caps.force_max_n = 8;
  device.device_caps.slew_max_n_s = 500;
  MappedDevice mapped(device, mapping, {});
  const double most_n = mapped.caps().force_max_n, change_n = mapped.caps().slew_max_n_s * 1e-3;
  CHECK(most_n == Approx(3.7));
  Micros now{};
  Vec3 force = Vec3::Zero(), before = Vec3::Zero();
  for (int k = 0; k < 2000; ++k) {
    device.reading.buttons = k / 300 % 2 == 1 ? 1 : 0;
    mapped.read(now += kMs);
    // As fast as the scene's limit allows, up and down.
    const double want_n = k % 80 < 40 ? most_n : 0;
    force.z() += std::clamp(want_n - force.z(), -change_n, change_n);
    mapped.write(force);
    REQUIRE(device.written.norm() <= 8 + 1e-12);
    REQUIRE((device.written - before).norm() <= 0.5 + 0.6 * kFadeSlewMax1S * 1e-3);
    before = device.written;
  }
}

TEST_CASE("By default the middle of what the device reaches is at home, for a grasp the place where the tool is first") {
  ScriptedDevice device;
  device.device_caps.workspace = {Vec3(-0.1, -0.1, 0.1), Vec3(0.1, 0.1, 0.3)};
  device.reading.position = Vec3(0, 0, 0.25);
  const Vec3 home(0.05, 0.05, 0.1);
  MappedDevice touching(device, {}, {home, false}), grasping(device, {}, {home, true});
  CHECK(touching.caps().workspace.center().isApprox(home, 1e-12));
  CHECK(grasping.caps().workspace.min().isApprox(home - Vec3::Constant(0.2), 1e-12));
  CHECK(grasping.caps().workspace.max().isApprox(home + Vec3::Constant(0.2), 1e-12));
  CHECK(touching.read(kMs).position.isApprox(home + Vec3(0, 0, 0.05), 1e-12));
  CHECK(grasping.read(kMs).position.isApprox(home, 1e-12));
  WorkspaceMapping with_clutch;
  with_clutch.clutch_button = 0;
  CHECK(MappedDevice(device, with_clutch, {home, false}).caps().workspace.max() == Vec3::Constant(kWorldExtentM));
  ScriptedDevice unknown;
  CHECK(MappedDevice(unknown, {}, {home, false}).caps().workspace.isEmpty());
  unknown.reading.position = Vec3(7, 7, 7);
  CHECK(MappedDevice(unknown, {}, {home, false}).read(kMs).position.isApprox(home, 1e-12));
}

TEST_CASE("A button that the device does not have and a weight that takes all its force are refused") {
  DeviceCaps caps;
  caps.name = "stick";
  caps.force_max_n = 2;
  WorkspaceMapping mapping;
  mapping.clutch_button = 0;
  CHECK_THAT(fault_of(mapping, caps),
             Catch::Contains("w.json: clutch_button is 0; expected no such field: stick has no buttons"));
  caps.buttons = 2;
  CHECK(fault_of(mapping, caps).empty());
  mapping.dead_man_button = 2;
  CHECK_THAT(fault_of(mapping, caps), Catch::Contains("dead_man_button is 2; expected 0 to 1"));
  mapping.dead_man_button.reset();
  mapping.tool_weight_n = Vec3(0, 0, -2);
  CHECK_THAT(fault_of(mapping, caps), Catch::Contains("w.json: tool_weight_n is 2.0"));
}

TEST_CASE("A mapping is found by the device's own name, else by that of its kind") {
  WorkspaceMapping kind, own;
  kind.scale = 2;
  own.scale = 3;
  const std::vector<NamedMapping> all{{"openhaptics", kind}, {"openhaptics:left", own}};
  CHECK(mapping_for(all, "openhaptics:left")->scale == 3);
  CHECK(mapping_for(all, "openhaptics:right")->scale == 2);
  CHECK(mapping_for(all, "openhaptics")->scale == 2);
  CHECK_FALSE(mapping_for(all, "hid"));
}

TEST_CASE("A torque reaches the hand turned, and with the share of power that the force has, and its limits are scaled back") {
  WorkspaceMapping mapping;
  mapping.scale = 2.5;
  mapping.force_scale = 0.7;
  mapping.rotation_deg = Vec3(20, -35, 110);
  ScriptedDevice device;
  device.device_caps.renders_torque = true;
  device.device_caps.force_max_n = 8;
  device.device_caps.torque_max_nm = 0.3;
  device.device_caps.torsion_stiffness_max_nm_rad = 1;
  MappedDevice mapped(device, mapping, {});
  CHECK(mapped.caps().torque_max_nm == Approx(0.3 * 2.5 / 0.7));
  CHECK(mapped.caps().torsion_stiffness_max_nm_rad == Approx(2.5 / 0.7));
  Micros now{};
  for (int k = 0; k < 1000; ++k) mapped.read(now += kMs);
  const Vec3 torque(0.1, -0.2, 0.3);
  mapped.write({Vec3(0, 0, 1), torque});
  // A rotation by a small angle is the same in both frames but for its axis.
  const Vec3 angle_d(1e-3, -2e-3, 5e-4), angle_w = mapping.rotation() * angle_d;
  CHECK(device.turned.dot(angle_d) == Approx(0.7 / 2.5 * torque.dot(angle_w)));
  mapped.write({Vec3(0, 0, 1), 100 * torque});
  CHECK(device.turned.norm() == Approx(0.3));
  CHECK(device.written.norm() == Approx(0.7 * 0.3 / (0.7 / 2.5 * 100 * torque.norm())));  // by the same factor
}
