// A haptic device as the 1 kHz loop sees it: read where the tool is, write the force that the hand shall feel.
//
// read, write, resume and stop are called from one thread, once a millisecond; they do not allocate, lock, log, throw or wait.
// Everything is in frame W [m, N]: axes, units and signs of the hardware end inside the adapter.
//
// Life of a real device: not_ready (it homes, it waits to be calibrated) -> ok <-> fault (it took its force away: too hot, too
// fast) -> gone (unplugged) -> not_ready again when it comes back. Every state but ok means: no force, and `position` is worth
// nothing. Force begins at zero whenever ok begins.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/types.hpp"

namespace palpate {

/// What a device can do. A number that is 0, and a box that is empty, are not known.
struct DeviceCaps {
  std::string name;                 ///< of its kind, as --device names it
  double force_max_n = 0;           ///< peak force it can render, Euclidean norm
  double slew_max_n_s = 0;          ///< largest change of force
  double stiffness_max_n_m = 0;     ///< stable rendering limit at 1 kHz
  double force_continuous_n = 0;    ///< force it can hold without end, at which its motors do not overheat
  double velocity_max_m_s = 0;      ///< faster than this a hand does not move it: a jump, or a device out of control
  Eigen::AlignedBox3d workspace{};  ///< that the tool point can reach [m]
  bool renders_force = true;        ///< false: what is written is felt by nobody
  bool has_orientation = false;     ///< readings carry one
  int buttons = 0;                  ///< that it has, 32 at most
  Micros watchdog{};                ///< driver or device take the force away by themselves when nothing was written for so long
  std::string model{};              ///< maker, model, serial number and driver as the device says them, for reports
};

enum class DeviceState : std::uint8_t {
  ok,
  not_ready,  ///< homes or waits to be calibrated; the reason says what a person has to do
  fault,      ///< it is there and took its force away
  gone,       ///< it cannot be reached; it may come back
  ended       ///< a recorded motion is over: there will be no more
};

/// Why, in a few words for a person: a clause about the device, which is "it" ("its motors are too hot: let them cool"). Of fixed
/// size, cut when longer; set and copied without allocating.
class DeviceReason {
 public:
  static constexpr std::size_t kMaxBytes = 95;
  DeviceReason() = default;
  DeviceReason(std::string_view text) noexcept : size_(static_cast<std::uint8_t>(std::min(text.size(), kMaxBytes))) {
    std::copy_n(text.data(), size_, text_.data());
  }
  DeviceReason(const char* text) noexcept : DeviceReason(std::string_view(text)) {}
  std::string_view text() const noexcept { return {text_.data(), size_}; }

 private:
  std::array<char, kMaxBytes> text_{};
  std::uint8_t size_ = 0;
};

/// T, the tool's axes: z along the shaft from the tip to the hand; held level before a person, pointing away, x to the right and
/// y up.
struct DeviceReading {
  Vec3 position = Vec3::Zero();  ///< tool point in frame W [m]
  DeviceState state = DeviceState::gone;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< R_WT, of unit length
  std::uint32_t buttons = 0;                                        ///< bit n: button n is pressed
  DeviceReason reason{};                                            ///< empty while ok
  double share = 1;  ///< of what is written next that the hand feels: less where a clutch fades the force
  bool ok() const noexcept { return state == DeviceState::ok; }
};

/// Nothing but why there is nothing.
inline DeviceReading not_ok(DeviceState state, const DeviceReason& reason) noexcept {
  DeviceReading reading;
  reading.state = state;
  reading.reason = reason;
  return reading;
}

class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceCaps& caps() const = 0;
  /// `now` is the client's monotonic clock; simulated devices advance their own dynamics to it.
  virtual DeviceReading read(Micros now) noexcept = 0;
  /// Force on the tool [N] from now on. One that is not finite counts as zero.
  virtual void write(const Vec3& force) noexcept = 0;
  /// Makes the device safe: zero force. Called on every way out.
  virtual void stop() noexcept = 0;
  /// Zero force, and zero whatever is written, until resume(). From any thread, also while read() or write() hang in a driver,
  /// and from a signal handler: no lock, no memory, no wait. The default serves where stop() is the store of a number.
  virtual void halt() noexcept { stop(); }
  /// After halt(): forces that are written count again.
  virtual void resume() noexcept {}
};

}  // namespace palpate
