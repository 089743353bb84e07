// The curve of least jerk from 0 to 1, at rest at both ends: c^3 (10 - 15 c + 6 c^2) at the share c of its time, constant before
// 0 and after 1. Source: Flash and Hogan, J. Neurosci. 5 (1985).
#pragma once

#include <algorithm>

namespace palpate {

inline double minimum_jerk(double share) {
  const double c = std::clamp(share, 0.0, 1.0);
  return c * c * c * (10 - 15 * c + 6 * c * c);
}

/// Slope of the curve.
inline double minimum_jerk_rate(double share) {
  const double c = std::clamp(share, 0.0, 1.0);
  return 30 * c * c * (1 - c) * (1 - c);
}

}  // namespace palpate
