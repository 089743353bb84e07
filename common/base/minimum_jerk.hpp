// The curve of least jerk from 0 to 1, at rest at both ends: m(c) = c^3 (10 - 15 c + 6 c^2) at the share c of its time, constant
// before 0 and after 1. Source: Flash and Hogan, J. Neurosci. 5 (1985).
#pragma once

#include <algorithm>

#include "common/base/types.hpp"

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

/// A vector that fades to zero along the curve: f(t) = (1 - m((t - begin) / length)) from.
struct FadingVector {
  Micros begin{}, length{1};
  Vec3 from = Vec3::Zero();

  bool over(Micros t) const { return t >= begin + length || from.isZero(0); }
  Vec3 at(Micros t) const { return (1 - minimum_jerk(share(t))) * from; }
  /// f'(t) [1/s]
  Vec3 rate(Micros t) const { return -(minimum_jerk_rate(share(t)) / seconds(length)) * from; }

 private:
  double share(Micros t) const { return seconds(t - begin) / seconds(length); }
};

}  // namespace palpate
