// Which readings of a driver are trusted: those before a fault is over, a place that is not a number and a jump are not.
//
// A tool that moved further between two readings than velocity_max allows in kLate did not move: an encoder lost count, a cable
// was pulled, or the driver slept. Forces computed from such a place would be anything, so readings count as `fault` until
// kSteadyTurns sane ones came in a row. Belongs to the driver's thread; does not allocate.
#pragma once

#include "client/device/device.hpp"

namespace palpate {

class ReadingGate {
 public:
  static constexpr Micros kLate{2'000};       ///< a driver's thread may come by so much later than the time before
  static constexpr Micros kSteady{100'000};   ///< of sane readings after a jump
  static constexpr Micros kFault{1'000'000};  ///< without a new one until a driver's fault counts as over

  /// `driver_hz`: readings a second; `velocity_max_m_s`: no jump is seen when it is 0.
  ReadingGate(double driver_hz, double velocity_max_m_s) noexcept;

  /// The driver says that it took the force away. Readings are `fault` for this reason until it has not said so for kFault.
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
