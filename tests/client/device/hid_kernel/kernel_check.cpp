// A device of the force profile behind /dev/uhid, and the usual host: kernel, hidraw, udev's list, hidapi, HidDevice.
//
// The device is the reference firmware on a simulated Phantom in a firm hand; the host renders a wall. Requirements: the device
// is found and opened by its serial number, its limits arrive, a constant force arrives to the millinewton, every force on the
// motors was written by the host, the device is reported gone when it is destroyed, and works again when it returns. Timing is
// reported but not judged, as it depends on the machine. Exit code 0: all of it held.
#include <fcntl.h>
#include <linux/input.h>
#include <linux/uhid.h>
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "client/device/hid/firmware/force_hid.h"
#include "client/device/hid/io/open_hid_device.hpp"
#include "client/device/sim_phantom.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"

using namespace palpate;

namespace {

using Millinewtons = std::array<std::int32_t, 3>;
constexpr double kStiffness = 300;
constexpr int kPatienceMs = 30'000;
constexpr std::size_t kWallForces = 500;

force_hid_limits arm_limits() {
  force_hid_limits limits{};
  limits.firmware_version = 1;
  limits.rate_hz = 1000;
  limits.watchdog_ms = 100;
  limits.ramp_ms = 50;
  limits.peak_mn = 8500;
  limits.continuous_mn = 1400;
  limits.stiffness_n_m = 1000;
  limits.slew_n_s = 2000;
  for (int i = 0; i < 3; ++i) limits.workspace_max_nm[i] = -(limits.workspace_min_nm[i] = -200'000'000);
  return limits;
}

/// A thread that steps the firmware once a millisecond and serves the kernel.
class UhidArm {
 public:
  UhidArm()
      : phantom_(Motion({{0.0, Vec3::Zero()}, {2.0, Vec3(0.01, 0.005, -0.01)}, {1000.0, Vec3(0.01, 0.005, -0.01)}}), firm()) {
    const force_hid_limits limits = arm_limits();
    force_hid_init(&core_, &limits);
    file_ = open("/dev/uhid", O_RDWR | O_CLOEXEC | O_NONBLOCK);
    if (file_ < 0) throw InputError("/dev/uhid", std::strerror(errno), "a kernel with uhid, and root");
    uhid_event event{};
    event.type = UHID_CREATE2;
    std::snprintf(reinterpret_cast<char*>(event.u.create2.name), sizeof event.u.create2.name, "Test Arm, Palpate HID 1");
    std::snprintf(reinterpret_cast<char*>(event.u.create2.uniq), sizeof event.u.create2.uniq, "kernel-check");
    event.u.create2.rd_size = FORCE_HID_DESCRIPTOR_BYTES;
    event.u.create2.bus = BUS_USB;
    event.u.create2.vendor = 0x1209;
    event.u.create2.product = 1;
    std::memcpy(event.u.create2.rd_data, force_hid_descriptor, FORCE_HID_DESCRIPTOR_BYTES);
    send(event);
    thread_ = std::thread([this] { run(); });
  }

  ~UhidArm() {
    end_ = true;
    thread_.join();
    uhid_event event{};
    event.type = UHID_DESTROY;
    send(event);
    close(file_);
  }

  Millinewtons force() {
    const std::lock_guard lock(mutex_);
    return force_;
  }
  /// Number of forces on the motors other than ramps since the last take_forces(), each counted once while constant.
  std::size_t count_forces() {
    const std::lock_guard lock(mutex_);
    return forces_.size();
  }
  std::vector<Millinewtons> take_forces() {
    const std::lock_guard lock(mutex_);
    return std::exchange(forces_, {});
  }

 private:
  static SimPhantomOptions firm() {
    SimPhantomOptions options;
    options.hand = {1, 10, 500};
    return options;
  }

  void send(const uhid_event& event) {
    if (write(file_, &event, sizeof event) < 0) std::perror("uhid");
  }

  void run() {
    prctl(PR_SET_TIMERSLACK, 1);
    auto due = std::chrono::steady_clock::now();
    while (!end_) {
      std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
      due = std::max(due, std::chrono::steady_clock::now() - std::chrono::milliseconds(5));
      serve();
      step();
    }
  }

  void serve() {
    uhid_event event{};
    while (read(file_, &event, sizeof event) > 0) {
      if (event.type == UHID_OUTPUT) {
        force_hid_receive(&core_, event.u.output.data, event.u.output.size, now_us());
      } else if (event.type == UHID_GET_REPORT) {
        uhid_event reply{};
        reply.type = UHID_GET_REPORT_REPLY;
        reply.u.get_report_reply.id = event.u.get_report.id;
        const bool known = event.u.get_report.rnum == FORCE_HID_FEATURE_ID;
        if (known)
          reply.u.get_report_reply.size =
              static_cast<std::uint16_t>(force_hid_feature_report(&core_, reply.u.get_report_reply.data));
        reply.u.get_report_reply.err = known ? 0 : EIO;
        send(reply);
      }
    }
  }

  void step() {
    const Vec3 position = phantom_.read(monotonic_now()).position;
    force_hid_sensors sensors{};
    sensors.homed = true;
    for (int i = 0; i < 3; ++i) sensors.position_nm[i] = static_cast<std::int32_t>(std::lround(position[i] * 1e9));
    uhid_event event{};
    event.type = UHID_INPUT2;
    {
      const std::lock_guard lock(mutex_);
      const Millinewtons before = force_;
      Millinewtons torque{};
      force_hid_step(&core_, &sensors, now_us(), force_.data(), torque.data());
      const bool whole = (core_.status & FORCE_HID_STATUS_RAMPING) == 0;
      if (whole && force_ != before) forces_.push_back(force_);
      event.u.input2.size = static_cast<std::uint16_t>(force_hid_input_report(&core_, event.u.input2.data));
    }
    phantom_.write(Vec3(force_[0], force_[1], force_[2]) * 1e-3);
    send(event);
  }

  static std::uint32_t now_us() { return static_cast<std::uint32_t>(monotonic_now().count()); }

  SimPhantom phantom_;
  force_hid_core core_{};
  std::mutex mutex_;
  Millinewtons force_{};
  std::vector<Millinewtons> forces_;
  int file_ = -1;
  std::atomic<bool> end_{false};
  std::thread thread_;
};

int g_faults = 0;

void check(bool holds, const char* what) {
  std::printf("%s: %s\n", holds ? "ok" : "FAILED", what);
  g_faults += !holds;
}

struct Loop {
  std::vector<double> late_us;
  int ticks = 0, not_ok = 0;

  /// Runs once per millisecond with the `force` for a reading, until `done`. Returns false on a timeout.
  bool run(Device& device, const std::function<Vec3(const DeviceReading&)>& force,
           const std::function<bool(const DeviceReading&)>& done) {
    auto due = std::chrono::steady_clock::now();
    for (int ms = 0; ms < kPatienceMs; ++ms) {
      std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
      const auto now = std::chrono::steady_clock::now();
      late_us.push_back(std::chrono::duration<double, std::micro>(now - due).count());
      due = std::max(due, now - std::chrono::milliseconds(1));
      const DeviceReading reading = device.read(monotonic_now());
      ++ticks;
      not_ok += !reading.ok();
      if (reading.ok()) device.write(force(reading));
      if (done(reading)) return true;
    }
    return false;
  }
};

constexpr Millinewtons kConstantMn{500, -250, 1000};
Vec3 constant(const DeviceReading&) { return {0.5, -0.25, 1}; }

bool waited(const std::function<bool()>& done) {
  for (int ms = 0; ms < kPatienceMs; ++ms) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

std::unique_ptr<Device> opened() {
  std::unique_ptr<Device> device;
  waited([&] {
    try {
      device = open_hid_device("kernel-check");
    } catch (const InputError& error) {
      std::fprintf(stderr, "not yet: %s\n", error.what());
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    return device != nullptr;
  });
  return device;
}

void feel_wall(UhidArm& arm, Device& device, Loop& loop) {
  std::vector<Millinewtons> written;
  const auto wall = [&](const DeviceReading& reading) {
    const Vec3 force = -kStiffness * reading.position;
    Millinewtons rounded{};
    for (int i = 0; i < 3; ++i) rounded[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(std::lround(force[i] * 1e3));
    written.push_back(rounded);
    return force;
  };
  arm.take_forces();  // forces before the wall do not count
  const bool enough = loop.run(device, wall, [&](const DeviceReading&) { return arm.count_forces() >= kWallForces; });
  const auto felt = arm.take_forces();
  std::sort(written.begin(), written.end());
  const auto strange = std::count_if(felt.begin(), felt.end(), [&](const Millinewtons& f) {
    return f != Millinewtons{} && f != kConstantMn && !std::binary_search(written.begin(), written.end(), f);
  });
  std::printf("wall: %zu forces written, %zu changes felt, %td of them never written\n", written.size(), felt.size(), strange);
  check(enough, "the wall is felt");
  check(strange == 0, "every force on the motors is one that the host wrote");
}

int run() {
  auto arm = std::make_unique<UhidArm>();
  const auto device = opened();
  check(device != nullptr, "the kernel's device is found by its serial number and opened");
  if (!device) return 1;
  std::printf("model: %s\n", device->caps().model.c_str());
  check(device->caps().force_max_n == 8.5 && device->caps().watchdog == Micros{100'000}, "its limits arrive");
  Loop loop;
  const auto renders = [&](const DeviceReading&) { return arm->force() == kConstantMn; };
  check(loop.run(*device, constant, renders), "a constant force arrives to the millinewton");
  feel_wall(*arm, *device, loop);
  arm.reset();
  check(loop.run(*device, constant, [](const DeviceReading& r) { return r.state == DeviceState::gone; }),
        "a destroyed device is gone");
  arm = std::make_unique<UhidArm>();
  check(loop.run(*device, constant, renders), "it comes back, and is felt");
  device->stop();
  check(waited([&] { return arm->force() == Millinewtons{}; }), "stop() leaves no force");
  std::sort(loop.late_us.begin(), loop.late_us.end());
  const auto percentile = [&](double p) {
    return loop.late_us[static_cast<std::size_t>(p * static_cast<double>(loop.late_us.size() - 1))];
  };
  std::printf("host loop: %d ticks, %d without a usable reading; late by p50 %.0f p99 %.0f p99.9 %.0f us\n", loop.ticks,
              loop.not_ok, percentile(0.5), percentile(0.99), percentile(0.999));
  return g_faults;
}

}  // namespace

int main() {
  try {
    const int faults = run();
    std::printf(faults == 0 ? "kernel check passed\n" : "kernel check failed\n");
    return faults == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
