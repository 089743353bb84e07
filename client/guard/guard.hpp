// The last metre of force. Whatever a patch says, what reaches the device is
//     finite check -> clamp -> ramp -> passivity limiter -> clamp -> slew limit -> finite check
// in this order: the limiter weighs what the device would show, not what was asked for. A force that is not finite counts as
// zero and never enters the limiter's memory; a tool position that is not finite makes the limiter skip the tick. A tick whose
// length is not a positive number leaves the force as it was.
//
// Clamp: the peak force, or what the motors can still take (motor_heat.hpp). Slew: a tick allows slew_max_n_s times its length,
// but no more than times kSlewTickMaxS: a tick that comes late is no reason for a step. Ramp: a share of the force that is 1 in
// ordinary use. It is 0 after restart() and after a gap of more than kGapMaxS between two ticks, when nobody knows what the
// device shows: the force begins at zero and is whole after kRampTicks. It falls while the tool is faster than velocity_max_m_s
// (its way over the last kSpeedTicks), to zero within kStopTicks, and comes back as after a gap.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "client/guard/motor_heat.hpp"
#include "client/guard/passivity.hpp"
#include "common/base/types.hpp"

namespace palpate {

/// off: not even observed. observe: the energy is recorded, the force untouched. on: an active display is damped.
enum class PassivityMode : std::uint8_t { off, observe, on };

struct GuardLimits {
  double force_max_n = 0;   ///< Euclidean norm, 0 = not limited
  double slew_max_n_s = 0;  ///< Euclidean norm of the change per second, 0 = not limited
  PassivityMode passivity = PassivityMode::off;
  double force_continuous_n = 0;  ///< that the motors hold for ever, 0 = the peak
  double velocity_max_m_s = 0;    ///< of the tool, 0 = not limited
  double stiffness_max_n_m = 0;   ///< a patch that is stiffer is shown that much weaker (haptic_tick.hpp), 0 = not limited
};

struct GuardCounts {
  std::uint64_t not_finite = 0, clamped = 0, slew_limited = 0, damped = 0;
  std::uint64_t heat_limited = 0;  ///< of those clamped: to less than the peak, because the motors were warm
  std::uint64_t too_fast = 0;      ///< ticks in which the tool was faster than the device's limit
  std::uint64_t restarts = 0;      ///< times that the force began at zero again
  double energy_min_j = 0;         ///< lowest energy that the passivity observer saw; negative: the display was active
  // what the passivity controller did to the force
  double dissipated_j = 0;                     ///< energy that its damper took out of the hand's motion
  double damper_max_n = 0, damper_sum_n2 = 0;  ///< of the force it added: largest; squares summed over the damped ticks
  /// Root mean square of the force it added, over the ticks that it damped [N].
  double damper_rms_n() const { return damped > 0 ? std::sqrt(damper_sum_n2 / static_cast<double>(damped)) : 0; }
};

class Guard {
 public:
  explicit Guard(const GuardLimits& limits = {});
  /// One tick: force on the tool asked for [N], where the tool is [m], length of the tick [s]. Returns the force to write.
  Vec3 pass(const Vec3& force, const Vec3& tool_position, double dt_s) noexcept;
  /// The clamp alone, counted like that of pass(), for what is faded before it is passed. Zero for what is not finite.
  Vec3 clamped(const Vec3& force) noexcept;
  /// The device shows nothing: the force begins at zero. What the motors have taken is not forgotten.
  void restart() noexcept;
  const GuardCounts& counts() const { return counts_; }
  const GuardLimits& limits() const { return limits_; }

  static constexpr double kSlewTickMaxS = 1e-3, kGapMaxS = 20e-3;
  static constexpr int kRampTicks = 50, kStopTicks = 20;
  static constexpr std::size_t kSpeedTicks = 8;

 private:
  Vec3 finite(const Vec3& force) noexcept;
  Vec3 passive(const Vec3& force, const Vec3& dx, double dt_s) noexcept;
  Vec3 limited(const Vec3& force) const noexcept;
  Vec3 slewed(const Vec3& force, double dt_s) noexcept;
  bool too_fast(const Vec3& dx, double dt_s) noexcept;

  GuardLimits limits_;
  GuardCounts counts_;
  MotorHeat heat_;
  Passivity passivity_;
  double share_ = 1;  ///< of the ramp
  struct Way {
    Vec3 dx = Vec3::Zero();
    double dt_s = 0;
  };
  std::array<Way, kSpeedTicks> ways_{};
  std::size_t newest_way_ = 0;
  Vec3 last_force_ = Vec3::Zero(), last_position_ = Vec3::Zero();
  bool has_position_ = false;
};

}  // namespace palpate
