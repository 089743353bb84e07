// The host's side of the force-device profile (docs/reference/hid-profile.md; firmware/force_hid.h has its bytes).
//
// Fields are found by usage, so a device may order, number and lengthen its reports as it likes. Positions come in nanometres
// and become metres, forces go in millinewtons, rounded to the nearest; the device's axes are frame W's.
//
// The host arms by an edge: it sends a report without ARM until the device says READY, one more, and then ARM. After a time-out
// of the device's watchdog that begins anew by itself; a fault is cleared kFaultHold after the device first said it, and only the
// device decides whether its cause is gone. Forces that are armed go with RAMP, so that the device brings them up over its own
// ramp, whatever the host asks for in its first tick.
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
  /// Reports with ARM that a READY device may leave without effect before the host begins anew.
  static constexpr int kArmingTries = 50;

  DeviceCaps begin(HidTransport& transport) override;
  bool take(std::span<const std::byte> report, HidInput& input) noexcept override;
  bool send(HidTransport& transport, const HidCommand& command, Micros now) noexcept override;
  Micros silence_max() const noexcept override { return kSilenceMax; }

  /// Whether a descriptor is one of this profile, whatever else it says.
  static bool is(const ReportDescriptor& descriptor);

 private:
  struct InputFields {
    HidField position[3], orientation[4], buttons, status, state;
    bool has_orientation = false;
  };
  struct OutputFields {
    HidField sequence, flags, force[3];
  };
  void bind(const ReportDescriptor& descriptor);
  DeviceCaps read_limits(HidTransport& transport, const ReportDescriptor& descriptor) const;
  std::uint8_t flags_for(const HidCommand& command, Micros now) noexcept;

  InputFields in_;
  OutputFields out_;
  std::vector<std::byte> report_;  ///< of output
  std::uint16_t sequence_ = 0;
  // The reader's word to the writer.
  std::atomic<std::uint8_t> state_{FORCE_HID_STATE_HOMING};
  // The writer's.
  bool disarmed_ = false;  ///< a report without ARM was sent since the device said READY
  int tries_ = 0;
  std::uint8_t seen_ = FORCE_HID_STATE_HOMING;
  Micros fault_since_{};
};

}  // namespace palpate
