// A stand-in for hidapi 0.13: the same functions over devices of the force profile that live in this process.
//
// Each device has a thread that steps its firmware once per millisecond and queues its input reports at every open handle, at
// most 64, as Linux's hidraw does. The test sets the encoders and reads the force on the motors.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/client/device/hid/bench_device.hpp"

namespace palpate::test {

/// Powered from its construction on; its user plugs and unplugs it.
class LiveDevice {
 public:
  using Report = std::array<std::uint8_t, FORCE_HID_INPUT_BYTES>;
  static constexpr std::size_t kQueued = 64;

  explicit LiveDevice(const force_hid_limits& limits = bench_limits());
  ~LiveDevice();

  void set_position(std::array<std::int32_t, 3> nm);
  void set_mute(bool mute);  ///< true: no input reports
  std::array<std::int32_t, 3> force();
  force_hid_state state();
  /// Largest increase so far of the force along x from one step to the next.
  std::int32_t largest_rise();

  // Called by the handles.
  int open();
  void close(int handle);
  int read(int handle, std::uint8_t* data, std::size_t size, int milliseconds);
  int write(const std::uint8_t* data, std::size_t size);
  int feature(std::uint8_t* data, std::size_t size);
  void unplug();
  int open_handles();

 private:
  void run();
  std::mutex mutex_;
  std::condition_variable changed_;
  BenchDevice bench_;
  std::vector<std::deque<Report>> queues_;
  std::vector<bool> open_;
  std::int32_t largest_rise_ = 0;
  bool mute_ = false, unplugged_ = false;
  std::atomic<bool> end_{false};
  std::thread thread_;
};

/// Entry that hidapi enumerates. A path without a device is listed and cannot be opened.
struct PluggedIn {
  std::string path;
  std::wstring maker, product, serial;
  std::uint16_t vendor = 0x1209, product_id = 1;
  std::shared_ptr<LiveDevice> device;
  int listed = 1;  ///< number of entries, as hidapi makes one per top-level usage
};

/// Devices of the machine; only one instance at a time.
class FakeHidapi {
 public:
  FakeHidapi();
  ~FakeHidapi();
  /// Creates node and descriptor in the file system too; returns the path of the node.
  std::string plug_in(const std::string& node, PluggedIn device, const std::vector<std::uint8_t>& descriptor);
  void unplug(const std::string& path);
  const std::filesystem::path& sysfs() const { return root_; }

 private:
  std::filesystem::path root_;
};

}  // namespace palpate::test
