// USB PID ("physical interface device", usage page 0x0F) joysticks: two axes in, two axes of force out.
//
// This is no haptic device for touching. A joystick reports neither its force in newtons nor its size in metres; its position has
// some 10 to 16 bits over the whole travel of the lever, its motors and gears have uncompensated friction, and its position often
// arrives at 100 to 500 Hz. The user therefore supplies force and reach (`force_max_n` at full magnitude, `reach_m` at full
// deflection); the third axis stands still, and forces along it are not felt.
//
// Force: one constant effect per axis, at the directions 90 and 0 degrees (where the force comes from, clockwise from away from
// the user), so that a tick sends only magnitudes, and only those that changed. An effect lasts kEffectTime and is restarted
// every kRestart; this serves as the watchdog, because the class has none. Axes: x right, y away from the user (HID's y points to
// the user). The sign of force follows the class; where a device differs, `flip_x`, `flip_y` invert it.
//
// Report ids, sizes and flags are found by usage. Sequence: Device Control reset, enable actuators; Device Gain; per axis Create
// New Effect, Block Load until it returns an index, Set Effect, Set Constant 0; then Effect Operation start. Sources: USB Device
// Class Definition for PID 1.0; the kernel's hid-pidff; the report layouts of ArduinoJoystickWithFFBLibrary and OpenFFBoard.
#pragma once

#include <array>
#include <vector>

#include "client/device/hid/hid_protocol.hpp"
#include "client/device/hid/report_descriptor.hpp"

namespace palpate {

struct ForceJoystickOptions {
  double force_max_n = 0;  ///< force at the grip at full magnitude, measured by the user; 0: unknown, which is refused
  double reach_m = 0.05;   ///< motion of the tool at full deflection
  double stiffness_max_n_m = 200;
  double slew_max_n_s = 500;
  bool flip_x = false, flip_y = false;  ///< inverts the force
};

class ForceJoystick final : public HidProtocol {
 public:
  static constexpr Micros kEffectTime{200'000}, kRestart{50'000};
  static constexpr int kLoadTries = 60;

  /// Throws InputError where a number is not positive.
  explicit ForceJoystick(const ForceJoystickOptions& options);

  DeviceCaps begin(HidTransport& transport) override;
  bool take(std::span<const std::byte> report, HidInput& input) noexcept override;
  bool send(HidTransport& transport, const HidCommand& command, Micros now) noexcept override;

  /// True for a device with X, Y and constant forces.
  static bool is(const ReportDescriptor& descriptor);

 private:
  struct Effect {
    std::int64_t index = 0;
    std::vector<std::byte> constant, start;  ///< reports with the index filled in
    std::int64_t sent = 0;                   ///< magnitude last sent
  };
  bool send_magnitude(HidTransport& transport, Effect& effect, double share) noexcept;

  ForceJoystickOptions options_;
  std::array<HidField, 2> axes_;
  std::vector<HidField> buttons_;
  HidField magnitude_;
  std::array<Effect, 2> effects_;
  Micros started_{};
  bool running_ = false;
};

}  // namespace palpate
