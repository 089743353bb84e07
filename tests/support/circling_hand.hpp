// A hand that moves on a circle, and how much of its motion is predictable in closed form.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>

#include "common/base/types.hpp"

namespace palpate::test {

inline constexpr double kRadiusM = 0.003;

inline Vec3 on_circle(double omega_rad_s, double t_s) {
  return kRadiusM * Vec3(std::cos(omega_rad_s * t_s), std::sin(omega_rad_s * t_s), 0);
}

/// Least-squares gain of x + h v on a circle, whose sums are those of a single moment.
inline double share_on_circle(double omega_rad_s, double horizon_s) {
  constexpr double kStepS = 0.03;
  using namespace std::complex_literals;
  const auto late = [&](double by_s) { return std::exp(-1i * omega_rad_s * by_s); };
  const auto expected = horizon_s * (3.0 - 4.0 * late(kStepS) + late(2 * kStepS)) / (2 * kStepS) * late(horizon_s);
  return std::clamp(std::real(std::conj(expected) * (1.0 - late(horizon_s))) / std::norm(expected), 0.0, 1.0);
}

}  // namespace palpate::test
