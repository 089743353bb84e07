// The adapter against a library that follows HDAPI's rules, and against one that does not.
#include "client/device/openhaptics/openhaptics_device.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <functional>
#include <thread>

#include "client/device/openhaptics/hd_frame.hpp"
#include "common/base/error.hpp"
#include "common/base/rotation_vector.hpp"
#include "tests/client/device/load_standin.hpp"

using namespace palpate;

namespace {

constexpr Micros kHdTick{1'000};

Standin& standin_hd() {
  static Standin& standin = load_standin("hd", "PALPATE_LIBHD");
  return standin;
}

/// The adapter over a stand-in whose time advances tick by tick.
struct HdBench {
  Standin& standin = standin_hd();
  std::unique_ptr<OpenHapticsDevice> device;
  Micros now{};
  Vec3 pushed = Vec3::Zero();

  explicit HdBench(const Motion& motion = Motion::rest(Vec3(0.01, 0.02, 0.03), 1.0), StandinFault fault = StandinFault::none) {
    standin.begin(motion, still_hand());
    standin.by_hand(true);
    standin.misbehave(fault);
    device = std::make_unique<OpenHapticsDevice>();
  }
  ~HdBench() {
    standin.misbehave(StandinFault::none);
    device.reset();
    CHECK(standin.breaches() == std::vector<std::string>{});
  }
  static SimPhantomOptions still_hand() {
    SimPhantomOptions hand;
    hand.tremor_m = 0;
    hand.hand = *hand_from_name("firm");
    return hand;
  }
  /// A millisecond of the driver, then one of the loop.
  DeviceReading tick() {
    standin.tick();
    const DeviceReading reading = device->read(now += kHdTick);
    device->write(pushed);
    return reading;
  }
  /// The reading after `ticks` milliseconds.
  DeviceReading run(int ticks) {
    DeviceReading reading;
    for (int i = 0; i < ticks; ++i) reading = tick();
    return reading;
  }
  Vec3 felt() const { return standin.log().back().force; }
  /// Waits, in real time, for other threads.
  bool comes(const std::function<bool()>& done) {
    for (int i = 0; i < 5000 && !done(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return done();
  }
};

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("Right, up and towards the person of HDAPI are right, up and towards the person in W", "[device]") {
  const double right[] = {12, 0, 0}, up[] = {0, 12, 0}, near[] = {0, 0, 12};
  CHECK((hd::position_from(right) - Vec3(0.012, 0, 0)).norm() < 1e-15);
  CHECK((hd::position_from(up) - Vec3(0, 0, 0.012)).norm() < 1e-15);
  CHECK((hd::position_from(near) - Vec3(0, -0.012, 0)).norm() < 1e-15);
  for (int axis = 0; axis < 3; ++axis) {
    // A force along a motion does positive work in either frame: the same power in N mm/s and N m/s.
    const Vec3 force = Vec3::Unit(axis) + Vec3(0.3, -0.2, 0.1);
    double n[3];
    hd::force_to(force, n);
    const double moved[] = {3, -5, 7};
    CHECK(force.dot(hd::position_from(moved)) == Approx(1e-3 * (n[0] * moved[0] + n[1] * moved[1] + n[2] * moved[2])));
  }
}

TEST_CASE("A column-major transform of HDAPI is the rotation of the stylus in W", "[device]") {
  // Rotated by 90 degrees about D's x axis: y becomes z. In W that is also a rotation about x; z becomes -y.
  const double transform[16] = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 4, 5, 6, 1};
  const Mat3 r = hd::orientation_from(transform).toRotationMatrix();
  CHECK((r.col(0) - Vec3(1, 0, 0)).norm() < 1e-12);
  CHECK((r.col(1) - Vec3(0, -1, 0)).norm() < 1e-12);
  CHECK((r.col(2) - Vec3(0, 0, -1)).norm() < 1e-12);
}

TEST_CASE("openhaptics says what the library says that the device can do", "[device]") {
  HdBench bench;
  const DeviceCaps& caps = bench.device->caps();
  CHECK(caps.force_max_n == 8.5);
  CHECK(caps.force_continuous_n == 1.4);
  CHECK(caps.stiffness_max_n_m == Approx(800));
  CHECK(caps.slew_max_n_s == Approx(8.5 / 0.004));
  CHECK((caps.workspace.min() - Vec3(-0.190, -0.060, -0.095)).norm() < 1e-12);
  CHECK((caps.workspace.max() - Vec3(0.190, 0.130, 0.170)).norm() < 1e-12);
  CHECK(caps.has_orientation);
  CHECK(caps.renders_force);
  CHECK(caps.watchdog == Micros{20'000});
  CHECK(caps.model == "stand-in PHANTOM Premium 1.5, serial number 1, driver 1");
}

TEST_CASE("openhaptics reads place, turn and buttons and renders the force of the tick before", "[device]") {
  HdBench bench;
  const DeviceReading first = bench.run(3);
  REQUIRE(first.ok());
  CHECK((first.position - Vec3(0.01, 0.02, 0.03)).norm() < 1e-12);
  const Eigen::AngleAxisd level(M_PI / 2, Vec3::UnitX()), turned(M_PI / 6, Vec3::UnitZ());
  CHECK(first.orientation.angularDistance(Eigen::Quaterniond(turned * level)) < 1e-7);
  bench.standin.press(2);
  CHECK(bench.tick().buttons == 2);
  bench.pushed = Vec3(0.7, -1.4, 2.1);
  bench.run(2);
  CHECK((bench.felt() - bench.pushed).norm() < 0.04);
  bench.device->stop();
  bench.standin.tick();
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
}

TEST_CASE("A loop that stops ticking feels nothing 20 ms later, and nothing after halt", "[device]") {
  HdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  bench.run(30);
  const std::size_t before = bench.standin.log().size();
  for (int i = 0; i < 40; ++i) bench.standin.tick();
  const auto log = bench.standin.log();
  CHECK(log[before + 18].force.z() > 2);
  CHECK(log[before + 20].force == Vec3(Vec3::Zero()));
  bench.run(30);
  CHECK(bench.felt().z() > 2);
  std::thread([&] { bench.device->halt(); }).join();
  bench.run(1);
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
  bench.device->resume();
  bench.run(1);
  CHECK(bench.felt().z() > 2);
}

TEST_CASE("A device that is not calibrated asks for it in words, without force, until it is", "[device]") {
  HdBench bench(Motion::rest(Vec3::Zero(), 1.0), StandinFault::not_calibrated);
  bench.pushed = Vec3(0, 0, 2.1);
  const DeviceReading asks = bench.run(150);
  CHECK(asks.state == DeviceState::not_ready);
  CHECK(asks.reason.text() == "it is not calibrated: put the stylus into the inkwell");
  for (const StandinTick& tick : bench.standin.log()) CHECK(tick.force == Vec3(Vec3::Zero()));
  bench.standin.calibrate();
  CHECK(bench.run(250).ok());
  CHECK(bench.felt().z() > 2);
}

TEST_CASE("Faults of the driver come with a reason and end by themselves", "[device]") {
  const auto [fault, word] = GENERATE(table<StandinFault, std::string>({{StandinFault::hot, "hot"},
                                                                        {StandinFault::force_limit, "force limit"},
                                                                        {StandinFault::velocity_limit, "velocity limit"}}));
  HdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  REQUIRE(bench.run(10).ok());
  bench.standin.misbehave(fault);
  const DeviceReading at_fault = bench.run(3);
  CHECK(at_fault.state == DeviceState::fault);
  CHECK(std::string(at_fault.reason.text()).find(word) != std::string::npos);
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
  bench.standin.misbehave(StandinFault::none);
  CHECK(bench.run(900).state == DeviceState::fault);
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
  CHECK(bench.run(200).ok());
  CHECK(bench.felt().z() > 2);
}

TEST_CASE("A position that jumps or is no number takes the force away within two ticks", "[device]") {
  const StandinFault fault = GENERATE(StandinFault::jump, StandinFault::nan);
  HdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  REQUIRE(bench.run(10).ok());
  bench.standin.misbehave(fault);
  const DeviceReading reading = bench.run(2);
  CHECK(reading.state == DeviceState::fault);
  CHECK(reading.position.allFinite());
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
  bench.standin.misbehave(StandinFault::none);
  CHECK(bench.run(250).ok());
}

TEST_CASE("A cable that is pulled while touching is said, and the device comes back without force", "[device]") {
  HdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  REQUIRE(bench.run(10).ok());
  bench.standin.misbehave(StandinFault::lost);
  const DeviceReading lost = bench.run(2);
  CHECK(lost.state == DeviceState::gone);
  CHECK(lost.reason.text() == "the connection to it broke");
  CHECK(bench.felt() == Vec3(Vec3::Zero()));
  bench.standin.misbehave(StandinFault::none);
  const std::size_t before = bench.standin.log().size();
  bench.standin.by_hand(false);
  CHECK(bench.comes([&] {
    bench.device->write(Vec3(0, 0, 2.1));  // as a loop does that ignores the state
    return bench.device->read(bench.now).ok();
  }));
  const auto log = bench.standin.log();
  for (std::size_t i = before; i + 1 < log.size(); ++i) CHECK(log[i].force == Vec3(Vec3::Zero()));
}

TEST_CASE("A driver that goes silent or hangs in a call is gone for the loop, which goes on", "[device]") {
  const StandinFault fault = GENERATE(StandinFault::silent, StandinFault::blocks);
  HdBench bench;
  bench.standin.by_hand(false);
  REQUIRE(bench.comes([&] { return bench.device->read(bench.now).ok(); }));
  bench.standin.misbehave(fault);
  CHECK(bench.comes([&] { return bench.device->read(bench.now).state == DeviceState::gone; }));
  CHECK(bench.device->read(bench.now).reason.text() == "its driver has not been heard of for 20 ms");
  bench.standin.misbehave(StandinFault::none);
  CHECK(bench.comes([&] { return bench.device->read(bench.now).ok(); }));
}

TEST_CASE("A driver that hangs for good does not hang the program's end", "[device]") {
  Standin& standin = standin_hd();
  standin.begin(Motion::rest(Vec3::Zero(), 1.0), {});
  standin.by_hand(false);
  auto device = std::make_unique<OpenHapticsDevice>();
  standin.misbehave(StandinFault::blocks);
  while (device->read(Micros{}).state != DeviceState::gone) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  device.reset();
  CHECK(standin.in_use());
  standin.misbehave(StandinFault::none);
  while (standin.in_use()) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the hanging call ends
}

TEST_CASE("A driver that calls from another thread every time is served all the same", "[device]") {
  HdBench bench;
  bench.pushed = Vec3(0, 0, 2.1);
  bench.standin.misbehave(StandinFault::other_thread);
  CHECK(bench.run(20).ok());
  CHECK(bench.felt().z() > 2);
}

TEST_CASE("A second station on the same device, no device and another's name are refused in words", "[device]") {
  {
    HdBench bench;
    CHECK(refusal([] { OpenHapticsDevice second; }).find("the default device is already open") != std::string::npos);
  }
  CHECK(refusal([] { OpenHapticsDevice named("nobody"); }).find("the device 'nobody' does not open: Device fault") !=
        std::string::npos);
  standin_hd().misbehave(StandinFault::no_device);
  CHECK(refusal([] { OpenHapticsDevice none; }).find("--list-devices") != std::string::npos);
  standin_hd().misbehave(StandinFault::none);
}

TEST_CASE("A Phantom with six motors turns by the torque that is written, about the axis of the scene", "[device]") {
  HdBench bench;
  bench.device.reset();
  SimPhantomOptions hand = HdBench::still_hand();
  hand.wrist = SimWrist{.torque_step_nm = 0};
  hand.force_step_n = 0;
  bench.standin.begin(Motion::rest(Vec3::Zero(), 1.0), hand);
  bench.device = std::make_unique<OpenHapticsDevice>();
  const DeviceCaps& caps = bench.device->caps();
  CHECK(caps.renders_torque);
  CHECK(caps.torque_max_nm == Approx(0.3));
  CHECK(caps.torque_continuous_nm == Approx(0.05));
  CHECK(caps.torsion_stiffness_max_nm_rad == Approx(0.8));
  const Vec3 torque(0.02, -0.05, 0.03);
  const auto run = [&](int ticks) {
    DeviceReading reading;
    for (int ms = 0; ms < ticks; ++ms) {
      bench.standin.tick();
      reading = bench.device->read(bench.now += kHdTick);
      bench.device->write({Vec3(0, 0, 1), torque});
    }
    return reading;
  };
  const DeviceReading reading = run(1500);
  const StandinTick felt = bench.standin.log().back();
  CHECK((felt.torque - torque).norm() < 1e-12);
  CHECK(reading.orientation.angularDistance(Eigen::Quaterniond(felt.turn)) < 1e-3);
  CHECK((rotation_vector(Rotation(reading.orientation)) - torque / hand.wrist->stiffness_nm_rad).norm() < 2e-3);

  bench.standin.misbehave(StandinFault::no_torque);
  const DeviceReading refused = run(3);
  CHECK(refused.state == DeviceState::fault);
  CHECK(refused.reason.text() == "its library takes no torque in space: there is none from now on");
  CHECK(run(1100).ok());  // the force is there again
  CHECK((bench.felt() - Vec3(0, 0, 1)).norm() < 1e-12);
}

TEST_CASE("A Phantom of three motors has orientation and no torque", "[device]") {
  HdBench bench;
  CHECK(bench.device->caps().has_orientation);
  CHECK_FALSE(bench.device->caps().renders_torque);
}
