// A haptic device as the 1 kHz loop sees it: the loop reads the tool's pose and writes force and torque for the hand.
//
// read, write, resume and stop are called from one thread, once a millisecond; they do not allocate, lock, log, throw or wait.
// Everything is in frame W [m, N, N m]: axes, units and signs of the hardware end inside the adapter. "Force" below means the
// torque too, where a device renders one.
//
// Life of a real device: not_ready (homing, or waiting for calibration) -> ok <-> fault (it switched its force off: too hot, too
// fast) -> gone (unplugged) -> not_ready again when it returns. In every state but ok there is no force, and `position` is
// invalid. The force begins at zero whenever ok begins.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/wrench.hpp"

namespace palpate {

/// Capabilities of a device. A number that is 0, and a box that is empty, are not known.
struct DeviceCaps {
  std::string name;                 ///< name of its kind, as in --device
  double force_max_n = 0;           ///< peak force it can render, Euclidean norm
  double slew_max_n_s = 0;          ///< largest change of force
  double stiffness_max_n_m = 0;     ///< stable rendering limit at 1 kHz
  double force_continuous_n = 0;    ///< force that it can hold indefinitely without overheating its motors
  double velocity_max_m_s = 0;      ///< a hand does not move it faster: beyond lies a jump, or a device out of control
  Eigen::AlignedBox3d workspace{};  ///< box that the tool point can reach [m]
  bool renders_force = true;        ///< false: a written force has no effect
  bool has_orientation = false;     ///< true: readings carry an orientation
  bool has_opening = false;         ///< true: readings carry the opening of a gripper
  int buttons = 0;                  ///< number of buttons, 32 at most
  Micros watchdog{};                ///< silence of the host after which driver or device switch the force off by themselves
  // torque, about the tool point
  bool renders_torque = false;              ///< false: a written torque has no effect; orientation is needed for true
  double torque_max_nm = 0;                 ///< peak torque, Euclidean norm
  double torque_slew_max_nm_s = 0;          ///< largest change of torque
  double torque_continuous_nm = 0;          ///< torque that it can hold indefinitely
  double torsion_stiffness_max_nm_rad = 0;  ///< stable rendering limit at 1 kHz
  double spin_max_rad_s = 0;                ///< a hand does not turn it faster
  std::string model{};                      ///< maker, model, serial number and driver as the device reports them, for reports
};

enum class DeviceState : std::uint8_t {
  ok,
  not_ready,  ///< homing or waiting for calibration; the reason says what a person has to do
  fault,      ///< present, but it switched its force off
  gone,       ///< unreachable; it may come back
  ended       ///< a recorded motion is over: no more readings follow
};

/// Reason of a state, in a few words for a person: a clause with "it" or "its" for the device ("its motors are too hot: let them
/// cool"). Of fixed size, truncated when longer; set and copied without allocating.
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

/// One reading. Frame T, the tool's axes: z along the shaft from the tip to the hand. A tool held level before a person, pointing
/// away, has x to the right and y up.
struct DeviceReading {
  Vec3 position = Vec3::Zero();  ///< tool point in frame W [m]
  DeviceState state = DeviceState::gone;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< R_WT, of unit length
  std::uint32_t buttons = 0;                                        ///< bit n: button n is pressed
  DeviceReason reason{};                                            ///< empty while ok
  double opening = 0;                                               ///< of a gripper, 0 closed to 1 wide open
  double share = 1;  ///< share of the next written force that the hand feels, below 1 where a clutch fades the force
  bool ok() const noexcept { return state == DeviceState::ok; }
};

/// Returns a reading without a position: a state and its reason.
inline DeviceReading not_ok(DeviceState state, const DeviceReason& reason) noexcept {
  DeviceReading reading;
  reading.state = state;
  reading.reason = reason;
  return reading;
}

/// Exchanges with a driver that answers each command with a reading, since it was opened. All zero: the driver has no such
/// answers.
struct ExchangeFigures {
  std::uint64_t answers = 0;
  Micros total{}, most{};  ///< time from command to answer: the sum, the longest
};

class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceCaps& caps() const = 0;
  /// Callable from any thread.
  virtual ExchangeFigures exchanges() const { return {}; }
  /// `now` is the client's monotonic clock; simulated devices advance their own dynamics to it.
  virtual DeviceReading read(Micros now) noexcept = 0;
  /// Sets the wrench on the tool from now on. A part that is not finite counts as zero.
  virtual void write(const Wrench& wrench) noexcept = 0;
  /// Makes the device safe: zero force. Called on every path out.
  virtual void stop() noexcept = 0;
  /// Sets zero force, and ignores written forces until resume(). Callable from any thread, also while read() or write() hang in a
  /// driver, and from a signal handler: no lock, no memory, no wait. The default is correct where stop() only stores a number.
  virtual void halt() noexcept { stop(); }
  /// After halt(): written forces count again.
  virtual void resume() noexcept {}
};

}  // namespace palpate
