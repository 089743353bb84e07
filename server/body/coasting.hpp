// Where a hand goes that nobody hears of: on as it went, slower and slower, and it stands still after kCoastS,
//
//     x + v (t - t^2 / (2 kCoastS))
#pragma once

#include <algorithm>

#include "common/base/types.hpp"

namespace palpate {

inline const double kCoastS = seconds(Micros{100'000});

/// How far it has gone after `t_s` [m].
inline Vec3 coasted(const Vec3& velocity, double t_s) {
  const double s = std::min(t_s, kCoastS);
  return (s - s * s / (2 * kCoastS)) * velocity;
}
/// How fast it then is.
inline Vec3 coasting(const Vec3& velocity, double t_s) { return (1 - std::min(t_s, kCoastS) / kCoastS) * velocity; }

}  // namespace palpate
