// Where a hand goes that nobody hears of: on as it went, slower and slower, and it stands still after kDeadReckoningS,
//
//     x + v (t - t^2 / (2 kDeadReckoningS))
#pragma once

#include <algorithm>

#include "common/base/types.hpp"

namespace palpate {

inline const double kDeadReckoningS = seconds(Micros{100'000});

/// How far it has gone after `t_s` [m].
inline Vec3 dead_reckoned_displacement(const Vec3& velocity, double t_s) {
  const double s = std::min(t_s, kDeadReckoningS);
  return (s - s * s / (2 * kDeadReckoningS)) * velocity;
}
/// How fast it then is.
inline Vec3 dead_reckoned_velocity(const Vec3& velocity, double t_s) {
  return (1 - std::min(t_s, kDeadReckoningS) / kDeadReckoningS) * velocity;
}

}  // namespace palpate
