// The host's side of the force-device profile (docs/reference/hid-profile.md; firmware/force_hid.h has its bytes).
//
// Fields are found by usage, so a device may order, number and lengthen its reports freely. Positions arrive in nanometres and
// become metres, forces leave in millinewtons and torques in micronewton metres, rounded to the nearest; the device's axes are
// those of frame W. A device has a torque if it has the fields, says so in its features, and measures its orientation; it has a
// gripper if it has the field and says so.
//
// The host arms by an edge: it sends reports without ARM until the device reports READY, one more, and then ARM. After a time-out
// of the device's watchdog that sequence restarts by itself. A fault is cleared kFaultHold after the device first reported it,
// and only the device decides whether its cause is gone. Armed forces are sent with RAMP, so that the device raises them over its
// own ramp, whatever the host asks for in its first tick.
#pragma once

#include <array>
#include <atomic>
#include <vector>

#include "client/device/hid/firmware/force_hid.h"
#include "client/device/hid/hid_protocol.hpp"
#include "client/device/hid/report_descriptor.hpp"

namespace palpate {

class ForceProfile final : public HidProtocol {
 public:
  static constexpr Micros kSilenceMax{20'000};
  static constexpr Micros kFaultHold{1'000'000};
  static constexpr int kRateLeastHz = 100;
  /// Number of reports with ARM that a READY device may ignore before the host restarts the sequence.
  static constexpr int kArmingTries = 50;

  DeviceCaps begin(HidTransport& transport) override;
  bool take(std::span<const std::byte> report, HidInput& input) noexcept override;
  bool send(HidTransport& transport, const HidCommand& command, Micros now) noexcept override;
  Micros silence_max(const HidInput&) const noexcept override { return kSilenceMax; }

  /// True for a descriptor of this profile, whatever else it contains.
  static bool is(const ReportDescriptor& descriptor);

 private:
  struct InputFields {
    HidField position[3], orientation[4], buttons, status, state, opening;
    bool has_orientation = false, has_opening = false;
  };
  struct OutputFields {
    HidField sequence, flags, force[3], torque[3];
    bool has_torque = false;
  };
  void bind(const ReportDescriptor& descriptor);
  DeviceCaps read_limits(HidTransport& transport, const ReportDescriptor& descriptor) const;
  std::uint8_t flags_for(const HidCommand& command, Micros now) noexcept;

  InputFields in_;
  OutputFields out_;
  std::vector<std::byte> report_;  ///< output report
  std::uint16_t sequence_ = 0;
  // written by the reader, read by the writer
  std::atomic<std::uint8_t> state_{FORCE_HID_STATE_HOMING};
  // state of the writer
  bool disarmed_ = false;  ///< true: a report without ARM was sent since the device reported READY
  int tries_ = 0;
  std::uint8_t seen_ = FORCE_HID_STATE_HOMING;
  Micros fault_since_{};
};

}  // namespace palpate
