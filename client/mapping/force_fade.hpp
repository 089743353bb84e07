// Factor of a force that fades in and out without a step, however often the direction changes.
//
// A phase p runs between 0 and 1, in kIn up and in kOut down; the factor is that of a minimum-jerk motion (Flash and Hogan, J.
// Neurosci. 5, 1985):
//
//     a(p) = 10 p^3 - 15 p^4 + 6 p^5,        |a'| <= 15/8
//
// so that a force F changes by at most 15/8 F dt / kOut in a tick of dt, also when the direction reverses halfway, as with a
// button that bounces. A tick counts for 1 ms at most: after a longer gap the phase continues where it was.
#pragma once

#include <algorithm>

#include "common/base/types.hpp"

namespace palpate {

inline constexpr double kFadeOutS = 0.1, kFadeInS = 0.25;
inline constexpr double kFadeSlewMax1S = 15.0 / 8.0 / kFadeOutS;  ///< largest change of the factor per second

class ForceFade {
 public:
  /// Advances by a tick of length `passed`, towards the whole force or towards none. Returns the factor.
  double step(bool on, Micros passed) noexcept {
    const double dt_s = std::clamp(seconds(passed), 0.0, 1e-3);
    phase_ = std::clamp(phase_ + (on ? dt_s / kFadeInS : -dt_s / kFadeOutS), 0.0, 1.0);
    return share();
  }
  double share() const noexcept { return phase_ * phase_ * phase_ * (10 + phase_ * (6 * phase_ - 15)); }
  /// Sets the factor to zero at once, where the force is gone already.
  void reset() noexcept { phase_ = 0; }

 private:
  double phase_ = 0;
};

}  // namespace palpate
