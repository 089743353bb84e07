// Tests a device and this machine without a server: a trial of some seconds with the real 1 kHz loop, and a force test.
//
// The trial writes zero force and measures how late ticks are, the step size of the position, its noise while nobody moves the
// device (in its stillest second), the range it covered, and the buttons that were pressed. The force test pushes one axis after
// the other, with a small force that grows slowly, and observes in which direction the hand yields: along the push, or against
// it, which means a wrong sign. The torque test turns the tool about one axis after the other in the same way.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/device/device.hpp"
#include "client/io/haptic_loop.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

struct DeviceFigures {
  std::uint64_t ticks = 0, late_ticks = 0, skipped_ticks = 0;  ///< late: by more than 0.2 ms
  Histogram<10'000> late_us{1};                                ///< delay from due to awake
  double rate_hz = 0;                                          ///< ticks per second of the clock
  double seconds = 0;                                          ///< time for which it was ok
  double step_m = 0;            ///< smallest change of a coordinate between two readings; 0: it never changed
  Vec3 noise_m = Vec3::Zero();  ///< peak to peak noise in the stillest second, per axis
  double turned_rad = 0;        ///< largest angle between how it was held and how at first
  Eigen::AlignedBox3d reached;  ///< range that the tool covered, W's axes
  std::uint32_t buttons = 0;    ///< those that were pressed at least once
  double answers_hz = 0;        ///< answers of its driver per second
  ExchangeFigures exchanges;    ///< with a driver that answers, during the trial; `most` since it was opened
  DeviceState state = DeviceState::gone;
  std::string reason;  ///< reason why it was not ok at the end
};

/// Result of the force or torque test for one axis.
enum class Yield : std::uint8_t { along, against, not_at_all };

class DeviceCheck {
 public:
  /// Starts the loop. `device` is ready.
  DeviceCheck(Device& device, bool realtime);
  ~DeviceCheck();

  /// Returns the newest reading, each one once; nullptr when there is no newer one. Called by the constructing thread.
  const DeviceReading* newest();
  bool running() const;
  /// Pushes the tool along `axis` (0 x, 1 y, 2 z) with test_force_n() for a second. Blocks for that time; returns early when the
  /// device is not ok or `stop` is set.
  Yield push(int axis, const std::atomic<bool>& stop);
  double test_force_n() const;
  /// Turns the tool about `axis` with test_torque_nm(), likewise.
  Yield twist(int axis, const std::atomic<bool>& stop);
  double test_torque_nm() const;
  /// Ends the loop.
  DeviceFigures finish();

 private:
  Yield test(const Wrench& wrench, double least, const std::function<double(const DeviceReading&)>& along,
             const std::atomic<bool>& stop);
  class Probe;
  struct Display;
  std::unique_ptr<Probe> probe_;
  std::unique_ptr<Display> display_;
  std::unique_ptr<HapticLoop> loop_;
  Micros begin_{};
  ExchangeFigures before_;
};

inline constexpr Micros kRemindEvery{5'000'000};

/// Waits until `device` is ok, reading it, and passes every new reason why it is not to `say`, with the time waited, and the
/// reason again every kRemindEvery. Returns false when `stop` was set or after `most`. `clock`: monotonic_now() by default.
bool wait_until_ready(Device& device, Micros most, const std::atomic<bool>& stop,
                      const std::function<void(const DeviceReading&, Micros waited)>& say,
                      const std::function<Micros()>& clock = monotonic_now);

/// Returns the figures as a table, with the histogram of lateness.
std::string describe(const DeviceFigures& figures, const DeviceCaps& caps);
/// Returns the deficits, one line each; empty: all is well.
std::vector<std::string> faults_of(const DeviceFigures& figures, const DeviceCaps& caps);

}  // namespace palpate
