// The last metre of force. Whatever a patch says, what reaches the device is
//     finite check -> clamp -> passivity limiter -> clamp -> slew limit -> finite check
// in this order: the limiter weighs what the device would show, not what was asked for. A force that is not finite counts as
// zero and never enters the limiter's memory; a tool position that is not finite makes the limiter skip the tick. A tick whose
// length is not a positive number leaves the force as it was.
#pragma once

#include <cmath>
#include <cstdint>

#include "client/guard/passivity.hpp"
#include "common/base/types.hpp"

namespace palpate {

/// off: not even observed. observe: the energy is recorded, the force untouched. on: an active display is damped.
enum class PassivityMode : std::uint8_t { off, observe, on };

struct GuardLimits {
  double force_max_n = 0;   ///< Euclidean norm, 0 = not limited
  double slew_max_n_s = 0;  ///< Euclidean norm of the change per second, 0 = not limited
  PassivityMode passivity = PassivityMode::off;
};

struct GuardCounts {
  std::uint64_t not_finite = 0, clamped = 0, slew_limited = 0, damped = 0;
  double energy_min_j = 0;  ///< lowest energy that the passivity observer saw; negative: the display was active
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
  /// Forget the past (after a stop).
  void reset() noexcept;
  const GuardCounts& counts() const { return counts_; }

 private:
  Vec3 finite(const Vec3& force) noexcept;
  Vec3 passive(const Vec3& force, const Vec3& tool_position, double dt_s) noexcept;
  Vec3 limited(const Vec3& force) const noexcept;
  Vec3 slewed(const Vec3& force, double dt_s) noexcept;

  GuardLimits limits_;
  GuardCounts counts_;
  Passivity passivity_;
  Vec3 last_force_ = Vec3::Zero(), last_position_ = Vec3::Zero();
  bool has_position_ = false;
};

}  // namespace palpate
