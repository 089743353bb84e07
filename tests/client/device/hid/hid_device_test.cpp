// Host, threads, hidapi's functions and firmware together.
#include "client/device/hid/io/hid_device.hpp"

#include <catch2/catch.hpp>

#include "client/device/hardware/find_devices.hpp"
#include "client/device/hid/force_profile.hpp"
#include "client/device/hid/io/find_hid.hpp"
#include "client/device/hid/io/open_hid_device.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"
#include "tests/client/device/hid/fake_hidapi.hpp"
#include "tests/client/device/hid/pid_stick.hpp"
#include "tests/client/device/hid/space_mouse_bytes.hpp"
#include "tests/support/realtime_guard.hpp"

using namespace palpate;
using palpate::test::bench_limits;
using palpate::test::FakeHidapi;
using palpate::test::LiveDevice;
using palpate::test::PluggedIn;

namespace {

using Newtons = std::array<std::int32_t, 3>;
constexpr int kPatienceMs = 20'000;

const std::vector<std::uint8_t> kProfile(force_hid_descriptor, force_hid_descriptor + FORCE_HID_DESCRIPTOR_BYTES);

PluggedIn plugged_in(std::shared_ptr<LiveDevice> device) {
  return {{}, L"Workshop", L"Arm, Palpate HID 1", L"7", 0x1209, 1, device, 1};
}

/// Runs once per millisecond, like the haptic loop, until `done` is true for the reading.
template <class Done>
bool loop(Device& device, const Vec3& force, Done done) {
  for (int ms = 0; ms < kPatienceMs; ++ms) {
    const DeviceReading reading = device.read(monotonic_now());
    if (done(reading)) return true;
    if (reading.ok()) device.write(force);
    std::this_thread::sleep_for(Micros{1000});
  }
  return false;
}

struct Machine {
  FakeHidapi hidapi;
  std::shared_ptr<LiveDevice> live;
  std::string path;

  explicit Machine(const force_hid_limits& limits = bench_limits()) : live(std::make_shared<LiveDevice>(limits)) { plug_in(); }
  void plug_in() { path = hidapi.plug_in("hidraw0", plugged_in(live), kProfile); }
  std::unique_ptr<HidDevice> open() {
    HidDeviceOptions options;
    options.model = "Workshop Arm";
    options.open = [this](std::string& fault) -> std::unique_ptr<HidTransport> {
      for (const FoundHid& found : find_hid(hidapi.sysfs())) return open_hid(found, fault, hidapi.sysfs());
      fault = "is not plugged in";
      return nullptr;
    };
    return std::make_unique<HidDevice>(std::make_unique<ForceProfile>(), std::move(options));
  }
};

}  // namespace

TEST_CASE("Devices are found with their kind, model and serial number, also those that may not be opened", "[hid]") {
  FakeHidapi hidapi;
  PluggedIn twice = plugged_in(std::make_shared<LiveDevice>());
  twice.listed = 3;
  hidapi.plug_in("hidraw4", twice, kProfile);
  hidapi.plug_in("hidraw1", {{}, L"3Dconnexion", L"SpaceNavigator", L"", 0x046D, 0xC626, nullptr, 1},
                 test::two_report_descriptor());
  hidapi.plug_in("hidraw2", {{}, L"", L"Keyboard \x00e9", L"", 1, 2, nullptr, 1}, {0x05, 0x01, 0x09, 0x06, 0xA1, 0x01, 0xC0});
  hidapi.plug_in("hidraw3", {{}, L"", L"Broken", L"", 1, 2, nullptr, 1}, {0xC0});
  const auto found = find_hid(hidapi.sysfs());
  REQUIRE(found.size() == 2);
  CHECK(found[0].kind == HidKind::space_mouse);
  CHECK(found[0].model == "3Dconnexion SpaceNavigator");
  CHECK_FALSE(found[0].may_open);
  CHECK(found[1].kind == HidKind::force_profile);
  CHECK(found[1].serial == "7");
  CHECK(found[1].may_open);
  std::string fault;
  CHECK(open_hid(found[0], fault, hidapi.sysfs()) == nullptr);
  CHECK(fault.find("cannot be opened: No such file") == 0);
}

TEST_CASE("A found device is listed with what opens it, and with the rule that lets its user in", "[hid]") {
  FakeHidapi hidapi;
  hidapi.plug_in("hidraw1", {{}, L"3Dconnexion", L"SpaceNavigator", L"", 0x046D, 0xC626, nullptr, 1},
                 test::two_report_descriptor());
  const auto listed = find_hid_devices(hidapi.sysfs());
  REQUIRE(listed.size() == 1);
  CHECK(listed[0].kind == "hid");
  CHECK(listed[0].text == "six-axis mouse, no force: 3Dconnexion SpaceNavigator (USB 046d:c626)");
  CHECK_FALSE(listed[0].usable);
  CHECK(listed[0].rule == R"(SUBSYSTEM=="hidraw", ATTRS{idVendor}=="046d", ATTRS{idProduct}=="c626", TAG+="uaccess")");
}

TEST_CASE("Force written by the loop is what the motors render, and positions come back", "[hid]") {
  Machine machine;
  machine.live->set_position({1'000'000, 2'000'000, 3'000'000});
  const auto device = machine.open();
  CHECK(device->caps().force_max_n == Approx(8.5));
  CHECK(device->caps().model == "Workshop Arm, firmware 7");
  Vec3 position = Vec3::Zero();
  REQUIRE(loop(*device, Vec3(0.5, -0.25, 1), [&](const DeviceReading& reading) {
    position = reading.position;
    return machine.live->force() == Newtons{500, -250, 1000};
  }));
  CHECK((position - Vec3(1e-3, 2e-3, 3e-3)).norm() < 1e-12);
  device->stop();
  CHECK(loop(*device, Vec3::Zero(), [&](const DeviceReading&) { return machine.live->force() == Newtons{}; }));
}

TEST_CASE("A force that is not finite is none", "[hid]") {
  Machine machine;
  const auto device = machine.open();
  REQUIRE(loop(*device, Vec3(1, 1, 1), [&](const DeviceReading&) { return machine.live->force()[0] == 1000; }));
  CHECK(loop(*device, Vec3(std::nan(""), 1, 1), [&](const DeviceReading&) { return machine.live->force() == Newtons{}; }));
}

TEST_CASE("A loop that stops writing loses its force before the device's own watchdog has to act", "[hid]") {
  force_hid_limits limits = bench_limits();
  limits.watchdog_ms = 100;
  Machine machine(limits);
  const auto device = machine.open();
  REQUIRE(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force()[0] == 1000; }));
  for (int ms = 0; ms < kPatienceMs && machine.live->force() != Newtons{}; ++ms) std::this_thread::sleep_for(Micros{1000});
  CHECK(machine.live->force() == Newtons{});
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force()[0] == 1000; }));
}

TEST_CASE("halt() takes the force away from any thread and keeps it away until resume()", "[hid]") {
  Machine machine;
  const auto device = machine.open();
  REQUIRE(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force()[0] == 1000; }));
  std::thread([&] { device->halt(); }).join();
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force() == Newtons{}; }));
  int ticks = 0;
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) {
    CHECK(machine.live->force() == Newtons{});
    return ++ticks == 50;
  }));
  device->resume();
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force()[0] == 1000; }));
}

TEST_CASE("An unplugged device is gone in words, and comes back when plugged in again, from zero force", "[hid]") {
  force_hid_limits limits = bench_limits();
  limits.ramp_ms = 40;
  Machine machine(limits);
  const auto device = machine.open();
  const auto felt = [&](const DeviceReading&) { return machine.live->force()[0] == 1000; };
  REQUIRE(loop(*device, Vec3(1, 0, 0), felt));
  machine.hidapi.unplug(machine.path);
  DeviceReading gone;
  REQUIRE(
      loop(*device, Vec3(1, 0, 0), [&](const DeviceReading& reading) { return (gone = reading).state == DeviceState::gone; }));
  CHECK(gone.reason.text() == "unplugged, or switched off");
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force() == Newtons{}; }));
  machine.plug_in();
  REQUIRE(loop(*device, Vec3(1, 0, 0), felt));
  CHECK(device->read(monotonic_now()).ok());
  CHECK(machine.live->open_handles() == 2);
  CHECK(machine.live->largest_rise() <= 26);  // a 40th, to the millinewton
}

TEST_CASE("Another device in the place of the one that was unplugged is not taken for it", "[hid]") {
  Machine machine;
  const auto device = machine.open();
  REQUIRE(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force()[0] == 1000; }));
  machine.hidapi.unplug(machine.path);
  force_hid_limits stronger = bench_limits();
  stronger.peak_mn = 30'000;
  machine.live = std::make_shared<LiveDevice>(stronger);
  machine.plug_in();
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading& reading) {
    return reading.state == DeviceState::gone && reading.reason.text().find("other limits") != std::string_view::npos;
  }));
  CHECK(machine.live->force() == Newtons{});
}

TEST_CASE("A device whose reports stop is at fault while it lasts", "[hid]") {
  Machine machine;
  const auto device = machine.open();
  REQUIRE(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force()[0] == 1000; }));
  machine.live->set_mute(true);
  DeviceReading silent;
  CHECK(
      loop(*device, Vec3::Zero(), [&](const DeviceReading& reading) { return (silent = reading).state == DeviceState::fault; }));
  CHECK(silent.reason.text().find("its reports have stopped") == 0);
  // Further writes have no effect.
  for (int ms = 0; ms < kPatienceMs && machine.live->force() != Newtons{}; ++ms) {
    device->read(monotonic_now());
    device->write(Vec3(1, 0, 0));
    std::this_thread::sleep_for(Micros{1000});
  }
  CHECK(machine.live->force() == Newtons{});
  machine.live->set_mute(false);
  CHECK(loop(*device, Vec3::Zero(), [](const DeviceReading& reading) { return reading.ok(); }));
}

TEST_CASE("A device that is not there is refused with what was expected", "[hid]") {
  Machine machine;
  machine.hidapi.unplug(machine.path);
  CHECK_THROWS_WITH(machine.open(), Catch::Contains("Workshop Arm: is not plugged in; expected a device"));
}

TEST_CASE("read, write, halt, resume and stop suit a real-time thread", "[hid]") {
  Machine machine;
  const auto device = machine.open();
  REQUIRE(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return machine.live->force()[0] == 1000; }));
  test::RealtimeGuard guard;
  for (int n = 0; n < 500; ++n) {
    device->read(Micros{n});
    device->write(Vec3(1, 2, 3));
  }
  device->halt();
  device->resume();
  device->stop();
  CHECK(guard.end().none());
}

TEST_CASE("A device is opened by its serial number or node, and the only one without a name", "[hid]") {
  FakeHidapi hidapi;
  CHECK_THROWS_WITH(open_hid_device("", nullptr, hidapi.sysfs()), Catch::Contains("none is plugged in"));
  const auto live = std::make_shared<LiveDevice>();
  hidapi.plug_in("hidraw0", plugged_in(live), kProfile);
  CHECK(open_hid_device("", nullptr, hidapi.sysfs())->caps().model == "Workshop Arm, Palpate HID 1, serial number 7, firmware 7");
  PluggedIn other = plugged_in(std::make_shared<LiveDevice>());
  other.serial = L"8";
  hidapi.plug_in("hidraw1", other, kProfile);
  CHECK_THROWS_WITH(open_hid_device("", nullptr, hidapi.sysfs()),
                    Catch::Contains("several fit; expected hid:WHICH with one of hidraw0 (force device: Workshop Arm"));
  CHECK_THROWS_WITH(open_hid_device("9", nullptr, hidapi.sysfs()), Catch::Contains("there is no \"9\""));
  CHECK_THROWS_WITH(open_hid_device("7,reach-m=1", nullptr, hidapi.sysfs()), Catch::Contains("takes no reach-m"));
  for (const char* which : {"7", "hidraw0"}) {
    const auto device = open_hid_device(which, nullptr, hidapi.sysfs());
    CHECK(loop(*device, Vec3(0, 0, 2), [&](const DeviceReading&) { return live->force()[2] == 2000; }));
  }
}

TEST_CASE("Of two devices that are alike the one at the given node is opened, and again where it was plugged in", "[hid]") {
  FakeHidapi hidapi;
  std::array<std::shared_ptr<LiveDevice>, 2> live;
  std::array<std::string, 2> paths;
  for (std::size_t i = 0; i < 2; ++i) {
    live[i] = std::make_shared<LiveDevice>();
    live[i]->set_position({1'000'000 * static_cast<int>(i + 1), 0, 0});
    PluggedIn arm = plugged_in(live[i]);
    arm.serial = L"";
    paths[i] = hidapi.plug_in("hidraw" + std::to_string(i), arm, kProfile);
  }
  const auto device = open_hid_device("hidraw1", nullptr, hidapi.sysfs());
  const auto is_second = [](const DeviceReading& reading) {
    return reading.ok() && std::abs(reading.position.x() - 2e-3) < 1e-9;
  };
  REQUIRE(loop(*device, Vec3::Zero(), [](const DeviceReading& reading) { return reading.ok(); }));
  CHECK(is_second(device->read(monotonic_now())));
  hidapi.unplug(paths[1]);
  REQUIRE(loop(*device, Vec3::Zero(), [](const DeviceReading& reading) { return reading.state == DeviceState::gone; }));
  std::this_thread::sleep_for(2 * HidDevice::kLookAgain);  // time in which the first device could be taken for it
  CHECK(device->read(monotonic_now()).state == DeviceState::gone);
  PluggedIn again = plugged_in(live[1]);
  again.serial = L"";
  hidapi.plug_in("hidraw7", again, kProfile);
  REQUIRE(loop(*device, Vec3::Zero(), [](const DeviceReading& reading) { return reading.ok(); }));
  CHECK(is_second(device->read(monotonic_now())));
}

namespace {

/// A six-axis mouse that sends one report, if any, and nothing more.
class FallsSilent final : public HidTransport {
 public:
  explicit FallsSilent(std::vector<std::uint8_t> report) : report_(std::move(report)) {}
  std::span<const std::byte> descriptor() const override { return descriptor_; }
  int read(std::span<std::byte> report, Micros) noexcept override {
    if (report_.empty()) std::this_thread::sleep_for(Micros{1000});
    const auto bytes = test::bytes_of(std::exchange(report_, {}));
    std::copy(bytes.begin(), bytes.end(), report.begin());
    return static_cast<int>(bytes.size());
  }
  bool write(std::span<const std::byte>) noexcept override { return true; }
  int get_feature(std::span<std::byte>) noexcept override { return -1; }
  bool set_feature(std::span<const std::byte>) noexcept override { return false; }

 private:
  std::vector<std::byte> descriptor_ = test::bytes_of(test::one_report_descriptor());
  std::vector<std::uint8_t> report_;
};

std::unique_ptr<HidDevice> mouse_that_falls_silent(const std::vector<std::uint8_t>& report) {
  HidDeviceOptions options;
  options.open = [report](std::string&) { return std::make_unique<FallsSilent>(report); };
  return std::make_unique<HidDevice>(std::make_unique<SpaceMouse>(SpaceMouseOptions{}), std::move(options));
}

}  // namespace

TEST_CASE("A pushed six-axis mouse whose reports stop is at fault, and stands still, within half a second", "[hid]") {
  const auto device = mouse_that_falls_silent(test::six_axes({350, 0, 0, 0, 0, 0}));
  REQUIRE(loop(*device, Vec3::Zero(), [](const DeviceReading& reading) { return reading.ok(); }));
  const Micros pushed = monotonic_now();
  Vec3 after_half_a_second;
  for (int ms = 0; ms < 1000; ++ms) {  // of the time that is passed in: the test does not wait
    const DeviceReading reading = device->read(pushed + Micros{1000 * ms});
    if (ms < 500) continue;
    if (ms == 500) after_half_a_second = reading.position;
    REQUIRE(reading.state == DeviceState::fault);
    REQUIRE(reading.position == after_half_a_second);
  }
  CHECK(after_half_a_second.x() > 0.01);
}

TEST_CASE("A six-axis mouse that rests needs no reports, and one that never sent any is not ready", "[hid]") {
  const auto rests = mouse_that_falls_silent(test::six_axes({0, 0, 0, 0, 0, 0})), mute = mouse_that_falls_silent({});
  REQUIRE(loop(*rests, Vec3::Zero(), [](const DeviceReading& reading) { return reading.ok(); }));
  CHECK(rests->read(monotonic_now() + Micros{3'600'000'000}).ok());
  const DeviceReading reading = mute->read(monotonic_now());
  CHECK(reading.state == DeviceState::not_ready);
  CHECK(reading.reason.text() == "it has sent nothing yet: move it, and check its power, cable or radio");
}

TEST_CASE("Two devices on one machine are two hands", "[hid]") {
  FakeHidapi hidapi;
  std::array<std::shared_ptr<LiveDevice>, 2> live;
  std::array<std::unique_ptr<Device>, 2> devices;
  for (std::size_t i = 0; i < 2; ++i) {
    live[i] = std::make_shared<LiveDevice>();
    PluggedIn arm = plugged_in(live[i]);
    arm.serial = std::to_wstring(i);
    hidapi.plug_in("hidraw" + std::to_string(i), arm, kProfile);
    devices[i] = open_hid_device(std::to_string(i), nullptr, hidapi.sysfs());
  }
  CHECK(loop(*devices[0], Vec3(1, 0, 0), [&](const DeviceReading&) {
    devices[1]->read(monotonic_now());
    devices[1]->write(Vec3(0, 3, 0));
    return live[0]->force() == Newtons{1000, 0, 0} && live[1]->force() == Newtons{0, 3000, 0};
  }));
}
