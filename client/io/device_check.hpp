// Whether a device and this machine serve, without a server: a trial of some seconds over the real 1 kHz loop, and a force test.
//
// The trial writes zero force and watches: how late ticks are, in what steps the position comes, how much it moves while nobody
// moves it (its stillest second), where it has been, which buttons were pressed. The force test pushes one axis after the other,
// small and slowly grown, and looks where the hand yields: along the push, or against it, which is a sign that is wrong.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/device/device.hpp"
#include "client/io/haptic_loop.hpp"

namespace palpate {

struct DeviceFigures {
  std::uint64_t ticks = 0, late_ticks = 0, skipped_ticks = 0;  ///< late: by more than 0.2 ms
  Histogram<10'000> late_us{1};                                ///< from due to awake
  double rate_hz = 0;                                          ///< ticks a second by the clock
  double seconds = 0;                                          ///< that it was ok for
  double step_m = 0;            ///< smallest change of a coordinate between two readings; 0: it never changed
  Vec3 noise_m = Vec3::Zero();  ///< peak to peak in the stillest second, per axis
  Eigen::AlignedBox3d reached;  ///< where the tool has been, W's axes
  std::uint32_t buttons = 0;    ///< that were pressed at some time
  DeviceState state = DeviceState::gone;
  std::string reason;  ///< why it was not ok at the end
};

/// What the force test found of one axis.
enum class Yield : std::uint8_t { along, against, not_at_all };

class DeviceCheck {
 public:
  /// `device` is ready. The loop runs from here on.
  DeviceCheck(Device& device, bool realtime);
  ~DeviceCheck();

  /// Newest reading, once each; nullptr when there is no newer one. The thread that made this.
  const DeviceReading* newest();
  bool running() const;
  /// The tool is pushed along `axis` (0 x, 1 y, 2 z) with test_force_n() for a second. Waits that long; early when the device is
  /// not ok or `stop` is set.
  Yield push(int axis, const std::atomic<bool>& stop);
  double test_force_n() const;
  /// Ends the loop.
  DeviceFigures finish();

 private:
  class Probe;
  struct Display;
  std::unique_ptr<Probe> probe_;
  std::unique_ptr<Display> display_;
  std::unique_ptr<HapticLoop> loop_;
  Micros begin_{};
};

/// Waits until `device` is ok, reading it, and says each new reason why it is not. False when `stop` was set or `most` went by.
bool wait_until_ready(Device& device, Micros most, const std::atomic<bool>& stop,
                      const std::function<void(const DeviceReading&)>& say);

/// Numbers as a table, with the histogram of lateness.
std::string describe(const DeviceFigures& figures, const DeviceCaps& caps);
/// What does not serve, a line each; empty: all does.
std::vector<std::string> faults_of(const DeviceFigures& figures, const DeviceCaps& caps);

}  // namespace palpate
