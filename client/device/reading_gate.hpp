// Filters the readings of a driver: it rejects those during a fault, positions that are not finite, and jumps.
//
// A tool cannot have moved further between two readings than velocity_max allows in kLate: an encoder lost count, a cable was
// pulled, or the driver slept. Forces computed from such a position would be arbitrary, so readings count as `fault` until
// kSteadyTurns valid ones arrived in a row. Belongs to the driver's thread; does not allocate.
#pragma once

#include "client/device/device.hpp"

namespace palpate {

class ReadingGate {
 public:
  static constexpr Micros kLate{2'000};       ///< largest delay of a driver's turn beyond its period
  static constexpr Micros kSteady{100'000};   ///< duration of valid readings required after a jump
  static constexpr Micros kFault{1'000'000};  ///< time without a new fault after which a driver's fault counts as over

  /// `driver_hz`: readings a second; `velocity_max_m_s`: 0 disables the detection of jumps.
  ReadingGate(double driver_hz, double velocity_max_m_s) noexcept;

  /// Notes that the driver switched the force off. Readings are `fault` for this reason until it has not been reported for
  /// kFault.
  void refuse(const DeviceReason& reason) noexcept;
  DeviceReading pass(const DeviceReading& reading) noexcept;

 private:
  void refuse(const DeviceReason& reason, int turns) noexcept;

  int steady_turns_, fault_turns_;
  double jump_m_;
  int refused_turns_ = 0;
  DeviceReason reason_;
  Vec3 last_ = Vec3::Zero();
  bool has_last_ = false;
};

}  // namespace palpate
