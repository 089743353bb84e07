#include "client/device/reading_gate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

int turns_in(Micros time, double driver_hz) { return static_cast<int>(std::lround(driver_hz * seconds(time))); }

}  // namespace

ReadingGate::ReadingGate(double driver_hz, double velocity_max_m_s) noexcept
    : steady_turns_(turns_in(kSteady, driver_hz)),
      fault_turns_(turns_in(kFault, driver_hz)),
      jump_m_(velocity_max_m_s > 0 ? velocity_max_m_s * std::max(1 / driver_hz, seconds(kLate))
                                   : std::numeric_limits<double>::infinity()) {}

void ReadingGate::refuse(const DeviceReason& reason) noexcept { refuse(reason, fault_turns_); }

void ReadingGate::refuse(const DeviceReason& reason, int turns) noexcept {
  // Keep the reason of a fault when a jump follows it.
  if (turns >= refused_turns_) reason_ = reason;
  refused_turns_ = std::max(refused_turns_, turns);
}

DeviceReading ReadingGate::pass(const DeviceReading& reading) noexcept {
  DeviceReading passed = reading;
  const bool finite = reading.position.allFinite() && reading.orientation.coeffs().allFinite();
  if (reading.ok() && !finite) refuse("its position is not a number", steady_turns_);
  if (reading.ok() && finite && has_last_ && (reading.position - last_).norm() > jump_m_)
    refuse("its position jumped: no force until it is steady again", steady_turns_);
  has_last_ = reading.ok() && finite;
  if (has_last_) last_ = reading.position;
  if (refused_turns_ == 0 || !(reading.ok() || reading.state == DeviceState::fault)) return passed;
  --refused_turns_;
  passed.state = DeviceState::fault;
  passed.reason = reason_;
  if (!finite) {
    passed.position = last_;
    passed.orientation.setIdentity();
  }
  return passed;
}

}  // namespace palpate
