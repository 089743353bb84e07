#include "client/app/device_check.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "client/app/lines.hpp"
#include "client/device/hardware/find_devices.hpp"
#include "client/device/hardware/open_device.hpp"
#include "client/io/device_check.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

namespace {

constexpr Micros kLook{20'000}, kReadyMost{120'000'000};
constexpr double kTrialS = 10;
constexpr std::array kPushes{"to the right", "away from you", "up"};
constexpr std::array kTwists{"its top towards you", "its top to the right", "counter-clockwise seen from above"};

void tell(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

std::unique_ptr<Device> open_named(const AppOptions& options, const std::string& name) {
  if (is_hardware(name)) return open_hardware(name, realtime_setup(options.realtime));
  if (name != "sim" && name != "sim6")
    throw InputError("--check-device", "'" + name + "' is no device to try", "sim|sim6|" + std::string(kHardwareKinds));
  DeviceOptions sim{name == "sim6" ? DeviceKind::sim6 : DeviceKind::sim, options.hand, options.seed};
  auto device = make_device(Motion::rest(Vec3::Zero(), 1.0), sim);
  device->start(monotonic_now());
  return device;
}

/// Reads standard input until a line arrives; empty at its end, or when `stop` is set or the device is not ok any more.
std::string answer(const DeviceCheck& check, const std::atomic<bool>& stop) {
  std::string line;
  while (!stop && check.running()) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, static_cast<int>(kLook.count() / 1000)) <= 0) continue;
    char c = 0;
    if (read(STDIN_FILENO, &c, 1) != 1 || c == '\n') return line;
    line += c;
  }
  return "";
}

void watch(DeviceCheck& check, Micros duration, const std::atomic<bool>& stop) {
  std::uint32_t buttons = 0;
  for (const Micros begin = monotonic_now(); monotonic_now() - begin < duration && !stop && check.running();
       std::this_thread::sleep_for(kLook)) {
    const DeviceReading* reading = check.newest();
    if (!reading || !reading->ok() || reading->buttons == buttons) continue;
    for (int button = 0; button < 32; ++button)
      if ((reading->buttons ^ buttons) >> button & 1U)
        tell(fmt::format("  button {} {}", button, reading->buttons >> button & 1U ? "pressed" : "released"));
    buttons = reading->buttons;
  }
}

/// Says how the hand yielded to a push or twist. Returns false when that was the wrong way.
bool tell_yield(Yield yield, const char* done, const char* way) {
  switch (yield) {
    case Yield::along:
      tell(fmt::format("  {} {}: the hand yielded that way", done, way));
      return true;
    case Yield::not_at_all:
      tell(fmt::format("  {} {}: the hand did not yield; hold it more lightly and try again", done, way));
      return true;
    case Yield::against:
      break;
  }
  tell(fmt::format("  {} {}: the hand yielded the other way: the signs of its axes are wrong. Do not use it", done, way));
  return false;
}

/// Returns false when an axis pushed in the wrong direction.
bool test_forces(DeviceCheck& check, const std::atomic<bool>& stop) {
  tell(fmt::format(
      "force test: it will push {:.2f} N to the right, then away from you, then up, for a second each. Hold it lightly in "
      "its middle and let it move. Type yes to begin, anything else to skip it:",
      check.test_force_n()));
  if (answer(check, stop) != "yes") {
    tell("the force test was skipped");
    return true;
  }
  for (int axis = 0; axis < 3 && !stop && check.running(); ++axis) {
    if (!tell_yield(check.push(axis, stop), "pushed", kPushes[static_cast<std::size_t>(axis)])) return false;
  }
  return true;
}

/// Returns false when an axis turned in the wrong direction.
bool test_torques(DeviceCheck& check, const std::atomic<bool>& stop) {
  tell(
      fmt::format("torque test: it will turn with {:.0f} mN m about the axis to the right, then the one away from you, then the "
                  "one up, for a "
                  "second each. Hold it lightly and let it turn. Type yes to begin, anything else to skip it:",
                  1e3 * check.test_torque_nm()));
  if (answer(check, stop) != "yes") {
    tell("the torque test was skipped");
    return true;
  }
  for (int axis = 0; axis < 3 && !stop && check.running(); ++axis)
    if (!tell_yield(check.twist(axis, stop), "turned", kTwists[static_cast<std::size_t>(axis)])) return false;
  return true;
}

}  // namespace

int list_devices() {
  auto devices = find_usb_devices();
  const auto hid = find_hid_devices();
  devices.insert(devices.end(), hid.begin(), hid.end());
  fmt::print("{}", describe(devices, find_libraries()));
  return std::any_of(devices.begin(), devices.end(), [](const FoundDevice& d) { return d.usable; }) ? 0 : 1;
}

int check_device(const AppOptions& options, const std::atomic<bool>& stop) {
  const std::unique_ptr<Device> device = open_named(options, *options.check_device);
  const auto says = [&](const DeviceReading& reading, Micros waited) { tell(not_ready(*device, reading, waited)); };
  if (!wait_until_ready(*device, kReadyMost, stop, says)) {
    tell("does not serve: the device did not become ready");
    return 1;
  }
  const double trial_s = options.duration_s.value_or(kTrialS);
  tell(fmt::format("trying {} for {:g} s: leave it alone for some seconds, then move it to all its ends and press its buttons",
                   *options.check_device, trial_s));
  DeviceCheck check(*device, options.realtime);
  watch(check, from_seconds(trial_s), stop);
  const bool can_push = device->caps().renders_force && check.test_force_n() > 0 && !stop && check.running();
  bool pushes_right = !can_push || test_forces(check, stop);
  if (pushes_right && can_push && device->caps().renders_torque && !stop && check.running())
    pushes_right = test_torques(check, stop);
  const DeviceFigures figures = check.finish();
  fmt::print("{}", describe(figures, device->caps()));
  const std::vector<std::string> faults = faults_of(figures, device->caps());
  for (const std::string& fault : faults) tell("  " + fault);
  const bool serves = pushes_right && faults.empty();
  tell(serves ? "serves" : "does not serve");
  return serves ? 0 : 1;
}

}  // namespace palpate
