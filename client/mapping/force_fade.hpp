// A share of a force that comes and goes without a step, whenever it is asked to and however often it is asked otherwise.
//
// A phase p runs between 0 and 1, in kIn up and in kOut down; the share is that of a minimum-jerk motion (Flash and Hogan,
// J. Neurosci. 5, 1985):
//
//     a(p) = 10 p^3 - 15 p^4 + 6 p^5,        |a'| <= 15/8
//
// so that a force F changes by at most 15/8 F dt / kOut in a tick of dt, also when it turns round halfway, as with a button that
// bounces. A tick counts for 1 ms at most: who was away for longer goes on where he was.
#pragma once

#include <algorithm>

#include "common/base/types.hpp"

namespace palpate {

inline constexpr double kFadeOutS = 0.1, kFadeInS = 0.25;
inline constexpr double kFadeSlewMax1S = 15.0 / 8.0 / kFadeOutS;  ///< largest change of the share in a second

class ForceFade {
 public:
  /// A tick after `passed`: towards the whole force, or none of it. Returns the share.
  double step(bool on, Micros passed) noexcept {
    const double dt_s = std::clamp(seconds(passed), 0.0, 1e-3);
    phase_ = std::clamp(phase_ + (on ? dt_s / kFadeInS : -dt_s / kFadeOutS), 0.0, 1.0);
    return share();
  }
  double share() const noexcept { return phase_ * phase_ * phase_ * (10 + phase_ * (6 * phase_ - 15)); }
  /// To none at once: the force is gone already.
  void reset() noexcept { phase_ = 0; }

 private:
  double phase_ = 0;
};

}  // namespace palpate
