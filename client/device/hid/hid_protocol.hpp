// What one kind of HID device means by its reports. Three threads meet here, each with functions of its own: the reader of
// reports (begin, take), the writer (send), the haptic thread (read). HidDevice (io/hid_device.hpp) calls them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "client/device/device.hpp"
#include "client/device/hid/hid_transport.hpp"

namespace palpate {

/// What the newest reports said.
struct HidInput {
  DeviceReading reading;
  std::array<double, 6> deflection{};  ///< of devices that say how far a cap is pushed: x, y, z, rx, ry, rz, each -1 to 1
};

struct HidCommand {
  Vec3 force = Vec3::Zero();  ///< on the tool [N], finite
  bool armed = false;         ///< false: no force
  bool ramped = true;         ///< not armed any more: over the device's ramp, if it has one; false: at once
};

class HidProtocol {
 public:
  virtual ~HidProtocol() = default;
  /// On a device just opened, no other call in progress: what it can do. Throws InputError where it is not of this kind or says
  /// what cannot be.
  virtual DeviceCaps begin(HidTransport& transport) = 0;
  /// What is known of an open device before its first report.
  virtual HidInput unheard() const noexcept {
    HidInput input;
    input.reading.state = DeviceState::not_ready;
    input.reading.reason = "no report from it yet: move it";
    return input;
  }
  /// One input report into what is known; false: not one that this kind knows, `input` is as it was.
  virtual bool take(std::span<const std::byte> report, HidInput& input) noexcept = 0;
  /// Sends a command; false: the device is gone.
  virtual bool send(HidTransport& transport, const HidCommand& command, Micros now) noexcept = 0;
  /// What the haptic tick at `now` reads.
  virtual DeviceReading read(const HidInput& input, Micros now) noexcept {
    (void)now;
    return input.reading;
  }
  /// Without a report for longer the device does not work; zero: silence means that nothing changed.
  virtual Micros silence_max() const noexcept { return Micros{0}; }
};

}  // namespace palpate
