// The adapter against a library that follows DHD's rules, and against one that does not.
#include "client/device/forcedimension/forcedimension_device.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <functional>
#include <thread>

#include "client/device/forcedimension/dhd_frame.hpp"
#include "client/device/forcedimension/dhd_limits.hpp"
#include "client/device/forcedimension/dhd_session.hpp"
#include "common/base/error.hpp"
#include "common/base/rotation_vector.hpp"
#include "tests/client/device/load_standin.hpp"

using namespace palpate;

namespace {

constexpr Micros kDhdTick{1'000};

Standin& standin_dhd() {
  static Standin& standin = load_standin("dhd", "PALPATE_LIBDHD");
  return standin;
}

/// The adapter over a stand-in. With `threads` both run in real time, else tick by tick.
struct DhdBench {
  Standin& standin = standin_dhd();
  std::unique_ptr<ForceDimensionDevice> device;
  Micros now{};
  Vec3 pushed = Vec3::Zero();

  explicit DhdBench(bool threads = false, StandinFault fault = StandinFault::none) {
    SimPhantomOptions hand;
    hand.tremor_m = 0;
    hand.hand = *hand_from_name("firm");
    standin.begin(Motion::rest(Vec3(0.01, 0.02, 0.03), 1.0), hand);
    standin.by_hand(!threads);
    standin.misbehave(fault);
    device = std::make_unique<ForceDimensionDevice>(ForceDimensionOptions{0, Micros{60'000}, threads});
  }
  ~DhdBench() {
    standin.misbehave(StandinFault::none);
    device.reset();
    CHECK(standin.breaches() == std::vector<std::string>{});
  }
  /// One millisecond of the device, two turns of the driver, one tick of the loop.
  DeviceReading tick() {
    standin.tick();
    device->turn();
    device->turn();
    const DeviceReading reading = device->read(now += kDhdTick);
    device->write(pushed);
    return reading;
  }
  DeviceReading run(int ticks) {
    DeviceReading reading;
    for (int i = 0; i < ticks; ++i) reading = tick();
    return reading;
  }
  Vec3 felt() const { return standin.log().back().force; }
  bool comes(DeviceState state) {
    for (int i = 0; i < 5000; ++i) {
      if (device->read(now).state == state) return true;
      device->write(pushed);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
};

std::string dhd_refusal(const ForceDimensionOptions& options) {
  try {
    ForceDimensionDevice device(options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("Towards the person, right and up of DHD are that in W, and forces do the same work", "[device]") {
  CHECK(dhd::to_w(Vec3(1, 0, 0)) == Vec3(0, -1, 0));
  CHECK(dhd::to_w(Vec3(0, 1, 0)) == Vec3(1, 0, 0));
  CHECK(dhd::to_w(Vec3(0, 0, 1)) == Vec3(0, 0, 1));
  const Vec3 force(1, -2, 3), moved(0.3, 0.5, -0.7);
  CHECK(force.dot(moved) == Approx(dhd::to_d(force).dot(dhd::to_d(moved))));
  CHECK(dhd::to_w(dhd::to_d(force)) == force);
  // Rotated by 90 degrees about D's y axis, the axis that pointed away points up: z_T, towards the hand, is down, and y_T,
  // formerly up, points to the user.
  const double turned[3][3] = {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}};
  const Mat3 r = dhd::orientation_from(turned).toRotationMatrix();
  CHECK((r.col(0) - Vec3(1, 0, 0)).norm() < 1e-12);
  CHECK((r.col(1) - Vec3(0, -1, 0)).norm() < 1e-12);
  CHECK((r.col(2) - Vec3(0, 0, -1)).norm() < 1e-12);
}

TEST_CASE("forcedimension knows its types' limits and none of an unknown type", "[device]") {
  DhdBench bench;
  const DeviceCaps& caps = bench.device->caps();
  CHECK(caps.force_max_n == 12);
  CHECK(caps.stiffness_max_n_m == 5000);
  CHECK(caps.workspace.sizes() == Vec3::Constant(0.15));
  CHECK(caps.has_orientation);
  CHECK(caps.model == "Force Dimension omega.3 stand-in, serial number 42, number 0");
  CHECK(dhd::limits_of(91).force_max_n == 0);
}

TEST_CASE("forcedimension reads place, turn and buttons and renders force", "[device]") {
  DhdBench bench;
  const DeviceReading reading = bench.run(3);
  REQUIRE(reading.ok());
  CHECK((reading.position - Vec3(0.01, 0.02, 0.03)).norm() < 1e-12);
  const Eigen::AngleAxisd level(M_PI / 2, Vec3::UnitX()), turned(M_PI / 6, Vec3::UnitZ());
  CHECK(reading.orientation.angularDistance(Eigen::Quaterniond(turned * level)) < 1e-7);
  bench.standin.press(5);
  CHECK(bench.tick().buttons == 5);
  bench.pushed = Vec3(0.7, -1.4, 2.1);
  bench.run(3);
  CHECK((bench.felt() - bench.pushed).norm() < 0.04);
  bench.device->halt();
  bench.run(2);
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
}

TEST_CASE("The device's own watchdog takes the force away when this program sends nothing for 20 ms", "[device]") {
  DhdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  REQUIRE(bench.run(10).ok());
  const std::size_t before = bench.standin.log().size();
  for (int i = 0; i < 30; ++i) bench.standin.tick();  // neither driver thread nor loop, as after SIGKILL
  const auto log = bench.standin.log();
  CHECK(log[before + 18].force.z() > 2);
  CHECK(log[before + 20].force == Vec3(Vec3::Zero()));
  const DeviceReading reading = bench.run(60);
  CHECK(reading.state == DeviceState::fault);
  CHECK(reading.reason.text() == "it heard nothing of this program for 20 ms");
  CHECK(bench.run(2500).ok());
  CHECK(bench.felt().z() > 2);
}

TEST_CASE("A force switched off at the device stays off until the person switches it on", "[device]") {
  DhdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  REQUIRE(bench.run(10).ok());
  bench.standin.misbehave(StandinFault::button_off);
  CHECK(bench.run(60).reason.text() == "its force is switched off: press the force button at the device");
  CHECK(bench.run(3000).state == DeviceState::fault);
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
}

TEST_CASE("A device that exceeded its velocity limit says so and comes back a second after it is slow", "[device]") {
  DhdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  REQUIRE(bench.run(10).ok());
  bench.standin.misbehave(StandinFault::velocity_limit);
  CHECK(bench.run(60).reason.text() == "its velocity limit was exceeded");
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
  bench.standin.misbehave(StandinFault::none);
  CHECK(bench.run(2500).ok());
  CHECK(bench.felt().z() > 2);
}

TEST_CASE("A motor at its limit is no error, a jump and a place that is no number are", "[device]") {
  DhdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  REQUIRE(bench.run(10).ok());
  bench.standin.misbehave(StandinFault::force_limit);
  CHECK(bench.run(5).ok());
  for (const StandinFault fault : {StandinFault::jump, StandinFault::nan}) {
    bench.standin.misbehave(fault);
    const DeviceReading reading = bench.run(2);
    CHECK(reading.state == DeviceState::fault);
    CHECK(reading.position.allFinite());
    bench.run(1);
    CHECK(bench.felt() == Vec3(Vec3::Zero()));
    bench.standin.misbehave(StandinFault::none);
    REQUIRE(bench.run(250).ok());
  }
}

TEST_CASE("A device that must find its place warns first, moves, and can then be felt", "[device]") {
  DhdBench bench(true, StandinFault::not_calibrated);
  bench.pushed = Vec3(0, 0, 2.1);
  CHECK(bench.comes(DeviceState::not_ready));
  CHECK(bench.comes(DeviceState::ok));
  bench.standin.by_hand(true);
  for (const StandinTick& tick : bench.standin.log()) CHECK(tick.force.norm() <= 2.2);
}

TEST_CASE("A Force Dimension cable that is pulled is said, and the device comes back", "[device]") {
  DhdBench bench(true);
  REQUIRE(bench.comes(DeviceState::ok));
  bench.standin.misbehave(StandinFault::lost);
  REQUIRE(bench.comes(DeviceState::gone));
  CHECK(bench.device->read(bench.now).reason.text() == "the connection to it broke");
  bench.standin.misbehave(StandinFault::none);
  CHECK(bench.comes(DeviceState::ok));
}

TEST_CASE("A call of DHD that hangs leaves the loop and the program's end alone, and the device takes the force away",
          "[device]") {
  DhdBench bench(true);
  bench.pushed = Vec3(0, 0, 2.1);
  const auto push_until = [&](const std::function<bool()>& done) {
    for (int i = 0; i < 5000 && !done(); ++i) {
      bench.device->read(bench.now);
      bench.device->write(bench.pushed);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return done();
  };
  REQUIRE(push_until([&] { return !bench.standin.log().empty() && bench.felt().z() > 2; }));
  bench.standin.misbehave(StandinFault::blocks);
  const std::size_t hung = bench.standin.log().size();
  REQUIRE(push_until([&] { return bench.standin.log().size() > hung + 100; }));
  CHECK(bench.comes(DeviceState::gone));
  const auto log = bench.standin.log();
  for (std::size_t i = hung + 60; i < log.size(); ++i) CHECK(log[i].force == Vec3(Vec3::Zero()));
  bench.device.reset();
  bench.standin.misbehave(StandinFault::none);
  while (bench.standin.in_use()) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the hanging call ends
}

TEST_CASE("No device, another number and a device in use are said with what would do", "[device]") {
  standin_dhd().misbehave(StandinFault::no_device);
  CHECK(dhd_refusal({}).find("device 0 does not open: no device found; expected") != std::string::npos);
  standin_dhd().misbehave(StandinFault::none);
  CHECK(dhd_refusal({4}).find("expected 0 to 0") != std::string::npos);
  CHECK(dhd_refusal({-1}).find("expected a number from 0") != std::string::npos);
  DhdBench bench;
  CHECK(dhd_refusal({}).find("is already open") != std::string::npos);
}

TEST_CASE("A sigma.7 turns by the torque that is written, about the axis of the scene, and an omega is sent none", "[device]") {
  for (const bool turns : {true, false}) {
    DhdBench bench;
    bench.device.reset();
    SimPhantomOptions hand;
    hand.tremor_m = hand.force_step_n = 0;
    hand.hand = *hand_from_name("firm");
    if (turns) hand.wrist = SimWrist{.torque_step_nm = 0};
    bench.standin.begin(Motion::rest(Vec3::Zero(), 1.0), hand);
    bench.device = std::make_unique<ForceDimensionDevice>(ForceDimensionOptions{0, Micros{60'000}, false});
    const DeviceCaps& caps = bench.device->caps();
    CHECK(caps.renders_torque == turns);
    CHECK(caps.torque_max_nm == (turns ? 0.24 : 0.0));
    const Vec3 torque(0.02, -0.05, 0.03);
    Micros now{};
    DeviceReading reading;
    for (int ms = 0; ms < 1500; ++ms) {
      bench.standin.tick();
      bench.device->turn();
      reading = bench.device->read(now += kDhdTick);
      bench.device->write({Vec3(0, 0, 1), torque});
    }
    const StandinTick felt = bench.standin.log().back();
    CHECK((felt.torque - (turns ? torque : Vec3(Vec3::Zero()))).norm() < 1e-12);
    CHECK((felt.force - Vec3(0, 0, 1)).norm() < 1e-12);
    if (!turns) continue;
    CHECK(reading.orientation.angularDistance(Eigen::Quaterniond(felt.turn)) < 1e-3);
    CHECK((rotation_vector(Rotation(reading.orientation)) - torque / hand.wrist->stiffness_nm_rad).norm() < 2e-3);
  }
}

TEST_CASE("The gap of an omega.7's gripper is the opening of jaws, wide open at 25 mm, and a device without one has none") {
  DhdBench bench;
  CHECK_FALSE(bench.device->caps().has_opening);
  CHECK(bench.run(3).opening == 0);
  bench.device.reset();
  SimPhantomOptions hand;
  hand.tremor_m = 0;
  MotionHolds holds;
  holds.openings = {1, 0.25};
  bench.standin.begin(Motion({{0, Vec3::Zero()}, {0.075, Vec3::Zero()}}, holds), hand);
  bench.device = std::make_unique<ForceDimensionDevice>(ForceDimensionOptions{0, Micros{60'000}, false});
  CHECK(bench.device->caps().has_opening);
  bench.now = {};
  for (int ms = 0; ms < 60; ++ms) {
    const DeviceReading reading = bench.tick();
    CHECK(reading.opening == Approx(1 - 0.01 * ms).margin(0.011));  // a tick of the exchange
  }
  CHECK(bench.run(30).opening == Approx(0.25));
}
