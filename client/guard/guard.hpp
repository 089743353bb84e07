// The last stage before the device. Whatever a patch says, a wrench (a force, and a torque about the tool point) passes
//     finite check -> clamp -> ramp -> passivity limiter -> clamp -> slew limit -> finite check
// in this order: the limiter judges what the device would show, not what was requested. A force or torque that is not finite
// counts as zero and never enters the limiter's memory; a tool pose that is not finite makes the limiter skip the tick. A tick
// whose length is not a positive number leaves the force unchanged.
//
// The force of a partner that guides the tool (client/core/guidance.hpp) is added after the limiter, and its work is not in the
// limiter's account: it is that of the other hand, which may lead this one for as long as it likes, where a display of a body
// may not. Its own damper makes the two ends together passive, and its force is bounded there. Finite check, ramp, second clamp
// and slew limit apply to the sum.
//
// A device without torque (renders_torque) gets none, and its force is that of a torque of zero, to the bit. With it, force and
// torque pass every stage together: one scale for both, the largest for which the limit of each holds, so that the line of action
// stays, and a display that has a potential keeps one (docs/decisions/0077-torque.md).
//
// Clamp: the peak, or what the motors can still sustain (motor_heat.hpp; those that turn the tool have an account of their own).
// Slew: a tick allows slew_max_n_s and torque_slew_max_nm_s times its length, but at most times kSlewTickMaxS: a late tick is no
// reason for a step. Ramp: a factor of the force, 1 in ordinary use. It is 0 after restart() and after a gap of more than
// kGapMaxS between two ticks, because what the device shows is then unknown: the force begins at zero and is complete after
// kRampTicks. The ramp falls to zero within kStopTicks while the tool is faster than velocity_max_m_s, or turns faster than
// spin_max_rad_s (over the last kSpeedTicks), and recovers as after a gap.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "client/guard/motor_heat.hpp"
#include "client/guard/passivity.hpp"
#include "common/base/tool_shape.hpp"
#include "common/base/wrench.hpp"

namespace palpate {

/// off: energy is not observed. observe: energy is recorded, the force unchanged. on: an active display is damped.
enum class PassivityMode : std::uint8_t { off, observe, on };

struct GuardLimits {
  double force_max_n = 0;   ///< Euclidean norm, 0 = not limited
  double slew_max_n_s = 0;  ///< Euclidean norm of the change per second, 0 = not limited
  PassivityMode passivity = PassivityMode::off;
  double force_continuous_n = 0;  ///< force that the motors can hold indefinitely, 0 = the peak
  double velocity_max_m_s = 0;    ///< speed limit of the tool, 0 = not limited
  double stiffness_max_n_m = 0;   ///< a stiffer patch is scaled down to it (haptic_tick.hpp), 0 = not limited
  bool renders_torque = false;    ///< false: no torque; the limits below, 0 = not limited, do not matter
  double torque_max_nm = 0, torque_slew_max_nm_s = 0;
  double torque_continuous_nm = 0;          ///< torque that the motors can hold indefinitely, 0 = the peak
  double spin_max_rad_s = 0;                ///< limit of the tool's rate of rotation
  double torsion_stiffness_max_nm_rad = 0;  ///< as stiffness_max_n_m
};

struct GuardCounts {
  std::uint64_t not_finite = 0, clamped = 0, slew_limited = 0, damped = 0;
  std::uint64_t heat_limited = 0;      ///< subset of `clamped`: limited to less than the peak, because the motors were warm
  std::uint64_t too_fast = 0;          ///< ticks in which the tool moved or turned faster than the device's limit
  std::uint64_t restarts = 0;          ///< times that the force began at zero again
  std::uint64_t torques_left_out = 0;  ///< ticks with a torque that the device cannot render
  double energy_min_j = 0;             ///< lowest energy of the passivity observer; negative: the display was active
  // effect of the passivity controller
  double dissipated_j = 0;                     ///< energy that its damper took out of the hand's motion
  double damper_max_n = 0, damper_sum_n2 = 0;  ///< the force it added: largest norm; sum of squares over the damped ticks
  double damper_max_nm = 0;                    ///< the torque it added: largest norm
  /// Root mean square of the added force over the damped ticks [N].
  double damper_rms_n() const { return damped > 0 ? std::sqrt(damper_sum_n2 / static_cast<double>(damped)) : 0; }
};

class Guard {
 public:
  explicit Guard(const GuardLimits& limits = {});
  /// Runs one tick: requested wrench on the tool, pose of the tool, length of the tick [s], force of a partner's guidance [N].
  /// Returns the wrench to write.
  Wrench pass(const Wrench& wrench, const ToolPose& tool, double dt_s, const Vec3& guidance = Vec3::Zero()) noexcept;
  /// Applies the clamp alone, counted like that of pass(), to a wrench that is faded before it is passed. Zero for a part that is
  /// not finite.
  Wrench clamped(const Wrench& wrench) noexcept;
  /// Begins the force at zero again, after the device showed nothing. The heat of the motors is kept.
  void restart() noexcept;
  const GuardCounts& counts() const { return counts_; }
  const GuardLimits& limits() const { return limits_; }

  static constexpr double kSlewTickMaxS = 1e-3, kGapMaxS = 20e-3;
  static constexpr int kRampTicks = 50, kStopTicks = 20;
  static constexpr std::size_t kSpeedTicks = 8;

 private:
  Wrench finite(const Wrench& wrench) noexcept;
  Wrench passive(const Wrench& wrench, const SmallMotion& moved, double dt_s) noexcept;
  Wrench limited(const Wrench& wrench) const noexcept;
  Wrench slewed(const Wrench& wrench, double dt_s) noexcept;
  bool too_fast(const SmallMotion& moved, double dt_s) noexcept;

  GuardLimits limits_;
  GuardCounts counts_;
  MotorHeat heat_, torque_heat_;
  Passivity passivity_;
  double share_ = 1;  ///< current value of the ramp
  struct Way {
    SmallMotion moved;
    double dt_s = 0;
  };
  std::array<Way, kSpeedTicks> ways_{};
  std::size_t newest_way_ = 0;
  Wrench last_;
  ToolPose last_tool_;
  bool has_tool_ = false;
};

}  // namespace palpate
