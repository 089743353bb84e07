#include "client/device/hid/force_profile.hpp"

#include <catch2/catch.hpp>

#include "client/device/sim_phantom.hpp"
#include "common/base/error.hpp"
#include "tests/client/device/hid/bench_transport.hpp"

using palpate::DeviceCaps;
using palpate::DeviceReading;
using palpate::DeviceState;
using palpate::ForceProfile;
using palpate::HidCommand;
using palpate::HidInput;
using palpate::Micros;
using palpate::Motion;
using palpate::SimPhantom;
using palpate::SimPhantomOptions;
using palpate::Vec3;
using palpate::test::bench_limits;
using palpate::test::BenchDevice;
using palpate::test::BenchTransport;

namespace {

/// Host and device in one thread with one clock.
struct Bench {
  BenchDevice device;
  BenchTransport cable{device};
  ForceProfile profile;
  HidInput input;
  DeviceCaps caps;

  explicit Bench(const force_hid_limits& limits = bench_limits()) : device(limits), caps(profile.begin(cable)) {}

  DeviceReading read() {
    std::array<std::byte, 64> report{};
    const int got = cable.read(report, Micros{0});
    REQUIRE(got > 0);
    REQUIRE(profile.take(std::span(report).first(static_cast<std::size_t>(got)), input));
    return profile.read(input, Micros{device.now_us});
  }
  void write(const Vec3& force) { REQUIRE(profile.send(cable, {force, true, true}, Micros{device.now_us})); }
  /// One millisecond of the host.
  DeviceReading tick(const Vec3& force) {
    device.step();
    const DeviceReading reading = read();
    write(force);
    return reading;
  }
  Vec3 felt() const { return Vec3(device.force_mn[0], device.force_mn[1], device.force_mn[2]) * 1e-3; }
};

}  // namespace

TEST_CASE("A device's limits become the host's", "[hid]") {
  const Bench bench;
  CHECK(bench.caps.force_max_n == Approx(8.5));
  CHECK(bench.caps.force_continuous_n == Approx(1.4));
  CHECK(bench.caps.stiffness_max_n_m == 1000);
  CHECK(bench.caps.slew_max_n_s == 2000);
  CHECK(bench.caps.velocity_max_m_s == Approx(2));
  CHECK(bench.caps.watchdog == Micros{20'000});
  CHECK(bench.caps.buttons == 2);
  CHECK(bench.caps.has_orientation);
  CHECK(bench.caps.renders_force);
  CHECK(bench.caps.workspace.min().isApprox(Vec3(-0.1, -0.1, -0.1)));
  CHECK((bench.caps.workspace.max() - Vec3(0.1, 0.100000001, 0.100000002)).norm() < 1e-15);
}

TEST_CASE("Limits that cannot be, a short answer and another version are refused with the limit's name", "[hid]") {
  const auto refused = [](auto change) {
    force_hid_limits limits = bench_limits();
    change(limits);
    Bench bench(limits);
  };
  CHECK_THROWS_WITH(refused([](auto& l) { l.rate_hz = 60; }), Catch::Contains("rate [Hz] is 60; expected 100 to 65535"));
  CHECK_THROWS_WITH(refused([](auto& l) { l.stiffness_n_m = 0; }), Catch::Contains("stiffness [N/m] is 0"));
  CHECK_THROWS_WITH(refused([](auto& l) { l.slew_n_s = 0; }), Catch::Contains("slew [N/s] is 0"));
  CHECK_THROWS_WITH(refused([](auto& l) { l.workspace_max_nm[1] = l.workspace_min_nm[1] - 1; }), Catch::Contains("workspace"));
  CHECK_THROWS_WITH(refused([](auto& l) {
                      for (int i = 0; i < 3; ++i) l.workspace_max_nm[i] = l.workspace_min_nm[i] = 0;
                    }),
                    Catch::Contains("workspace is a point"));
  BenchDevice device;
  BenchTransport cable(device);
  ForceProfile profile;
  cable.feature_bytes = 20;
  CHECK_THROWS_WITH(profile.begin(cable), Catch::Contains("gave 20 bytes of its feature report; expected 75"));
  cable.feature_bytes = FORCE_HID_FEATURE_BYTES;
  cable.descriptor_bytes.resize(60);
  CHECK_THROWS_AS(profile.begin(cable), palpate::InputError);
}

TEST_CASE("A descriptor of other units, or without a field, is refused", "[hid]") {
  BenchDevice device;
  ForceProfile profile;
  for (std::size_t i = 0; i + 4 < FORCE_HID_DESCRIPTOR_BYTES; ++i) {
    BenchTransport cable(device);
    auto& bytes = cable.descriptor_bytes;
    if (bytes[i] != std::byte{0x65} || bytes[i + 1] != std::byte{0x11} || bytes[i + 2] != std::byte{0x55}) continue;
    bytes[i + 3] = std::byte{0x0A};  // 10 nm
    CHECK_THROWS_WITH(profile.begin(cable), Catch::Contains("another unit; expected nanometres"));
    break;
  }
  BenchTransport cable(device);
  cable.descriptor_bytes[10] = std::byte{0x70};  // usage of the first field,
  CHECK_NOTHROW(profile.begin(cable));           // the sequence of input reports, which no host needs
  for (std::size_t i = 0; i < FORCE_HID_DESCRIPTOR_BYTES; ++i)
    if (cable.descriptor_bytes[i] == std::byte{0x09} && cable.descriptor_bytes[i + 1] == std::byte{FORCE_HID_FLAGS})
      cable.descriptor_bytes[i + 1] = std::byte{0x70};
  CHECK_THROWS_WITH(profile.begin(cable), Catch::Contains("no field of usage 0x21"));
}

TEST_CASE("What encoders and buttons say is read to the nanometre", "[hid]") {
  Bench bench;
  bench.device.sensors = {true, 0, {12'345'678, -1, 99'999'999}, {0, 0, 23170, 23170}, 3, 0};
  bench.device.step();
  const DeviceReading reading = bench.read();
  CHECK(reading.ok());
  CHECK((reading.position - Vec3(0.012345678, -1e-9, 0.099999999)).norm() < 1e-15);
  CHECK(reading.buttons == 3);
  CHECK(reading.orientation.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()))) < 1e-4);
}

TEST_CASE("A gripper's opening is read as a share, if the device says that it has one", "[hid]") {
  force_hid_limits limits = bench_limits();
  for (const bool has : {false, true}) {
    limits.features = static_cast<std::uint8_t>(FORCE_HID_FEATURE_ORIENTATION | (has ? FORCE_HID_FEATURE_OPENING : 0));
    Bench bench(limits);
    CHECK(bench.caps.has_opening == has);
    bench.device.sensors.opening = 16384;
    bench.device.step();
    CHECK(bench.read().opening == Approx(16384 / 65535.0));
  }
}

TEST_CASE("A device is armed within three ticks and then feels the force rounded to the millinewton", "[hid]") {
  Bench bench;
  for (int ms = 0; ms < 3; ++ms) bench.tick(Vec3::Zero());
  bench.device.step();
  REQUIRE(bench.device.core.state == FORCE_HID_STATE_ARMED);
  bench.tick(Vec3(0.0006, -1.2344, 2));
  bench.device.step();
  CHECK(bench.device.force_mn == std::array<std::int32_t, 3>{1, -1234, 2000});
}

TEST_CASE("A device that homes, times out or faults says so in words, and is armed again without being asked", "[hid]") {
  Bench bench;
  bench.device.sensors.homed = false;
  CHECK(bench.tick(Vec3(1, 0, 0)).state == DeviceState::not_ready);
  bench.device.sensors.homed = true;
  for (int ms = 0; ms < 4; ++ms) bench.tick(Vec3(1, 0, 0));
  CHECK(bench.felt().x() == Approx(1));

  for (int ms = 0; ms < 21; ++ms) bench.device.step();  // the host stalls
  CHECK(bench.felt().norm() == 0);
  const DeviceReading late = bench.tick(Vec3(1, 0, 0));
  CHECK(late.state == DeviceState::fault);
  CHECK(late.reason.text().find("watchdog") != std::string_view::npos);
  for (int ms = 0; ms < 4; ++ms) CHECK(bench.tick(Vec3(1, 0, 0)).ok());
  CHECK(bench.felt().x() == Approx(1));

  bench.device.sensors.faults = FORCE_HID_STATUS_TOO_HOT;
  const DeviceReading hot = bench.tick(Vec3(1, 0, 0));
  CHECK(hot.state == DeviceState::fault);
  CHECK(hot.reason.text().find("hot") != std::string_view::npos);
  bench.device.sensors.faults = 0;
  int ms = 1;
  while (!bench.tick(Vec3(1, 0, 0)).ok()) REQUIRE(++ms < 2000);
  CHECK(ms >= 1000);  // kFaultHold
  for (int n = 0; n < 4; ++n) bench.tick(Vec3(1, 0, 0));
  CHECK(bench.felt().x() == Approx(1));
}

TEST_CASE("A device that was reset behind the host's back is armed again", "[hid]") {
  Bench bench;
  for (int ms = 0; ms < 5; ++ms) bench.tick(Vec3(1, 0, 0));
  REQUIRE(bench.felt().x() == Approx(1));
  const force_hid_limits limits = bench_limits();
  force_hid_init(&bench.device.core, &limits);
  bench.device.step();
  REQUIRE(bench.device.core.state == FORCE_HID_STATE_READY);
  int ms = 0;
  for (; bench.felt().x() == 0; ++ms) {
    REQUIRE(ms < 2 * ForceProfile::kArmingTries);
    bench.tick(Vec3(1, 0, 0));
  }
  CHECK(ms > ForceProfile::kArmingTries);
}

TEST_CASE("The first force after arming grows over the device's own ramp, whatever the host asks for", "[hid]") {
  force_hid_limits limits = bench_limits();
  limits.ramp_ms = 50;
  Bench bench(limits);
  double before = 0;
  for (int ms = 0; ms < 100; ++ms) {
    bench.tick(Vec3(0, 0, 5));
    CHECK(bench.felt().z() - before <= 0.1015);  // a fiftieth, to the millinewton
    before = bench.felt().z();
  }
  CHECK(before == Approx(5));
}

TEST_CASE("A report that is cut off or another one is not taken", "[hid]") {
  Bench bench;
  bench.device.step();
  std::array<std::byte, FORCE_HID_INPUT_BYTES> report{};
  bench.cable.read(report, Micros{0});
  for (std::size_t size = 0; size < 32; ++size) CHECK_FALSE(bench.profile.take(std::span(report).first(size), bench.input));
  report[0] = std::byte{9};
  CHECK_FALSE(bench.profile.take(report, bench.input));
  CHECK(bench.input.reading.state == DeviceState::gone);
}

TEST_CASE("Through the profile a simulated Phantom feels what it feels without: within the profile's quantum", "[hid]") {
  // A soft wall in all three axes, F = -K x, felt by a moving hand.
  constexpr double kStiffness = 500, kQuantumN = 1e-3, kStepM = 1e-9;
  SimPhantomOptions exact;
  exact.position_step_m = exact.force_step_n = 0;
  const Motion motion(
      {{0.0, Vec3::Zero()}, {0.4, Vec3(0.01, -0.005, 0.02)}, {1.1, Vec3(-0.008, 0.011, -0.01)}, {2.0, Vec3::Zero()}});
  SimPhantom alone(motion, exact), mechanics(motion, exact);
  const auto wall = [](const Vec3& x) { return Vec3(-kStiffness * x); };

  Bench bench;
  // With the hand, the system is m x'' + b x' + k x = F: rounding of F, at most half a quantum, moves x by no more than the L1
  // norm of the impulse response, which is the static one times coth(pi zeta / (2 sqrt(1 - zeta^2))).
  const double m = 0.575, b = 6, k = 135 + kStiffness, zeta = b / (2 * std::sqrt(k * m));
  const double swing = 1 / std::tanh(M_PI * zeta / (2 * std::sqrt(1 - zeta * zeta)));
  const double rounding = kQuantumN / 2 + kStiffness * kStepM;
  const double bound = rounding + kStiffness * rounding / k * swing;

  double most = 0, peak = 0, own = 0;
  for (int ms = 0; ms <= 2000; ++ms) {
    const Micros now{ms * 1000};
    const Vec3 expected = ms < 5 ? Vec3(Vec3::Zero()) : wall(alone.read(now).position);
    if (ms < 5) alone.read(now);
    alone.write(expected);
    const Vec3 true_position = mechanics.read(now).position;
    for (int i = 0; i < 3; ++i)
      bench.device.sensors.position_nm[i] = static_cast<std::int32_t>(std::lround(true_position[i] * 1e9));
    bench.device.step();
    const DeviceReading reading = bench.read();
    REQUIRE(reading.ok());
    bench.write(ms < 5 ? Vec3(Vec3::Zero()) : wall(reading.position));
    bench.device.step(0);
    mechanics.write(bench.felt());
    own = std::max(own, (bench.felt() - (ms < 5 ? Vec3(Vec3::Zero()) : wall(true_position))).cwiseAbs().maxCoeff());
    most = std::max(most, (bench.felt() - expected).cwiseAbs().maxCoeff());
    peak = std::max(peak, expected.norm());
  }
  CHECK(peak > 1);
  CHECK(own <= rounding);
  CHECK(most <= bound);
  CHECK(most > 0);
}

TEST_CASE(
    "A device that turns has its torque's limits and feels it rounded to the micronewton metre, and none without the feature",
    "[hid]") {
  Bench bench(palpate::test::turning_limits());
  CHECK(bench.caps.renders_torque);
  CHECK(bench.caps.torque_max_nm == Approx(0.3));
  CHECK(bench.caps.torque_continuous_nm == Approx(0.05));
  CHECK(bench.caps.torque_slew_max_nm_s == Approx(75));
  CHECK(bench.caps.torsion_stiffness_max_nm_rad == Approx(0.8));
  CHECK(bench.caps.spin_max_rad_s == Approx(30));
  for (int ms = 0; ms < 4; ++ms) {
    bench.device.step();
    bench.read();
    const palpate::Wrench wrench(Vec3(0, 0, 1), Vec3(0.0123456, -4e-7, 0.1));
    REQUIRE(bench.profile.send(bench.cable, {wrench, true, true}, Micros{bench.device.now_us}));
  }
  bench.device.step();
  CHECK(bench.device.torque_unm == std::array<std::int32_t, 3>{12'346, 0, 100'000});
  CHECK_FALSE(Bench().caps.renders_torque);
  force_hid_limits held = palpate::test::turning_limits();
  held.features = FORCE_HID_FEATURE_TORQUE;  // a torque without orientation is of no use
  CHECK_FALSE(Bench(held).caps.renders_torque);
  force_hid_limits slow = palpate::test::turning_limits();
  slow.torque_slew_mnm_s = 0;
  CHECK_THROWS_WITH(Bench(slow), Catch::Contains("change of torque [mN m/s] is 0"));
}

TEST_CASE("A device of force alone may leave the fields of torque out", "[hid]") {
  BenchDevice device;
  BenchTransport cable(device);
  for (std::size_t i = 0; i + 3 < FORCE_HID_DESCRIPTOR_BYTES; ++i)
    if (cable.descriptor_bytes[i] == std::byte{0x19} && cable.descriptor_bytes[i + 1] == std::byte{FORCE_HID_TORQUE_X})
      cable.descriptor_bytes[i + 1] = std::byte{0x80}, cable.descriptor_bytes[i + 3] = std::byte{0x82};
  ForceProfile profile;
  CHECK_FALSE(profile.begin(cable).renders_torque);
}
