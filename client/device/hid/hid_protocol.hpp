// Protocol of one kind of HID device. Three threads use it, each with functions of its own: the reader of reports (begin, take),
// the writer (send) and the haptic thread (read). HidDevice (io/hid_device.hpp) calls them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "client/device/device.hpp"
#include "client/device/hid/hid_transport.hpp"

namespace palpate {

/// State from the newest reports.
struct HidInput {
  DeviceReading reading;
  std::array<double, 6> deflection{};  ///< for devices that report how far a cap is pushed: x, y, z, rx, ry, rz, each -1 to 1
};

struct HidCommand {
  Wrench wrench;       ///< on the tool, finite
  bool armed = false;  ///< false: no force
  bool ramped = true;  ///< only while not armed: true ends the force over the device's ramp, if it has one; false ends it at once
};

class HidProtocol {
 public:
  virtual ~HidProtocol() = default;
  /// Initialises a device that was just opened, with no other call in progress, and returns its capabilities. Throws InputError
  /// where it is not of this kind or reports impossible values.
  virtual DeviceCaps begin(HidTransport& transport) = 0;
  /// Returns the state of an open device before its first report.
  virtual HidInput unheard() const noexcept {
    HidInput input;
    input.reading.state = DeviceState::not_ready;
    input.reading.reason = "it has sent nothing yet: move it, and check its power, cable or radio";
    return input;
  }
  /// Decodes one input report into `input`. Returns false for an unknown report, which leaves `input` unchanged.
  virtual bool take(std::span<const std::byte> report, HidInput& input) noexcept = 0;
  /// Sends a command. Returns false when the device is gone.
  virtual bool send(HidTransport& transport, const HidCommand& command, Micros now) noexcept = 0;
  /// Returns the reading for the haptic tick at `now`.
  virtual DeviceReading read(const HidInput& input, Micros now) noexcept {
    (void)now;
    return input.reading;
  }
  /// Longest silence of a working device after this input; zero: silence means that nothing changed.
  virtual Micros silence_max(const HidInput&) const noexcept { return Micros{0}; }
};

}  // namespace palpate
