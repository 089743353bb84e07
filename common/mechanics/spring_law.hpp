// The laws of springs: the tension T(e) [N] at an elongation e [m], its slope T' [N/m] and its energy, the integral of T from 0
// to e [J]; k is the stiffness at rest [N/m], l the rest length [m]. All are odd in e.
//
//     StiffeningSpring   T = k e (1 + c (e / l)^2);   c = 0: linear
//     ThighSkinSpring    T = k / k0 f(e),  f(x) = x / (p - q x), x in mm and f in N, k0 = f'(0); continued along its tangent
//     beyond
//                        90 % of the pole at p / q
//
// L is a number or a vector of the compiler (lanes.hpp) of doubles.
//
// Source of the second: skin of the thigh, eq. 5 of Cavusoglu and Tendick.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/base/doubles.hpp"

namespace palpate {

struct StiffeningSpring {
  double stiffening = 0;  ///< c

  template <typename L>
  PALPATE_INLINE void respond(const L& k, const L& rest, const L& e, L& tension, L& slope) const {
    const L strain = e / rest, growth = stiffening * strain * strain;
    tension = k * e * (1.0 + growth);
    slope = k * (1.0 + 3.0 * growth);
  }
  double energy(double k, double rest, double e) const {
    return 0.5 * k * e * e * (1 + 0.5 * stiffening * (e / rest) * (e / rest));
  }
};

struct ThighSkinSpring {
  static constexpr double kP = 5.4398, kQ = 0.1418, kEnd = 0.9 * kP / kQ;

  template <typename L>
  PALPATE_INLINE void respond(const L& k, const L& e, L& tension, L& slope) const {
    const L x = e * 1e3, size = x < 0.0 ? -x : x, end = L{} + kEnd, at = size < kEnd ? size : end;
    const L room = kP - kQ * at, steep = kP / (room * room), scale = k * (1e-3 * kP);
    const L pull = scale * (at / room + steep * (size - at));
    tension = x < 0.0 ? -pull : pull;
    slope = scale * steep * 1e3;
  }
  double energy(double k, double e) const {
    const double x = std::abs(e) * 1e3, at = std::min(x, kEnd), beyond = x - at, u = kQ * at / kP;
    // Series of -u - ln(1 - u) for small u, where the terms cancel.
    const double curve = u < 1e-3 ? u * u * (1.0 / 2 + u * (1.0 / 3 + u / 4)) : -u - std::log1p(-u);
    const double slope = kP / ((kP - kQ * at) * (kP - kQ * at));
    return k * 1e-6 * kP * (kP / (kQ * kQ) * curve + beyond * (at / (kP - kQ * at) + slope * beyond / 2));
  }
};

}  // namespace palpate
