// Fibres with one common direction at rest, the unit vector a, added to the law of a solid: transversely isotropic.
//
//     Psi = k/(2 b) h(b E^2) where they are longer than at rest, k/2 E^2 where shorter,   E = |F a|^2 - 1   [J/m^3]
//     P = S (F a) a^T,   S = 2 dPsi/dE
//     A dF = dF S a a^T + 2 S' (Q : dF) Q,   Q = (F a) a^T,   S' = dS/dE
//
// h is the integral of e, the exponential with its tangent beyond kLogGrowthMax (solid_law.hpp; b = 0: Psi = k/2 E^2): in
// extension S = 2 k E e(b E^2), else 2 k E. k = share mu_L: modulus of the fibres [Pa], b: no unit. They have no stress at rest,
// and S has no kink there or where fibres reverse. For small strains along them Young's modulus is larger by 4 k.
//
// Source: Weiss, Maker and Govindjee, CMAME 135 (1996); the exponential of the square from Holzapfel, Gasser and Ogden,
// J. Elasticity 61 (2000).
#pragma once

#include "common/mechanics/law.hpp"

namespace palpate {

struct FibreLaw {
  explicit FibreLaw(const Fibres& of) : fibres_(of) {}

  template <typename L>
  PALPATE_INLINE void energy(const LaneModuli<L>& m, const LaneMatrix<L>& h, L& psi) const {
    L along[3], strain;
    stretch(h, along, strain);
    for (std::size_t l = 0; l < kLanes<L>; ++l) {
      const double k = fibres_.share * m.mu[l], e = strain[l];
      psi[l] = fibres_.exponent == 0 || e <= 0 ? 0.5 * k * e * e
                                               : 0.5 * k / fibres_.exponent * growth_integral(fibres_.exponent * e * e);
    }
  }

  template <typename L>
  PALPATE_INLINE void add_stress(const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) const {
    L along[3], pull, slope;
    find(m, h, along, pull, slope);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) p.of[r][c] += pull * along[r] * fibres_.direction[static_cast<std::size_t>(c)];
  }

  template <typename L>
  PALPATE_INLINE void add_tangent(const LaneModuli<L>& m, const LaneMatrix<L>& h, Tangent<L>& a) const {
    L along[3], pull, slope;
    find(m, h, along, pull, slope);
    LaneMatrix<L> q, both;
    const auto& d = fibres_.direction;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) {
        q.of[r][c] = along[r] * d[c];
        both.of[r][c] = pull * (d[r] * d[c]);
      }
    a.add_right(both);
    a.add_outer(2.0 * slope, q);
  }

 private:
  /// Computes F a and E.
  template <typename L>
  PALPATE_INLINE void stretch(const LaneMatrix<L>& h, L (&along)[3], L& strain) const {
    const auto& a = fibres_.direction;
    for (std::size_t r = 0; r < 3; ++r) along[r] = h.of[r][0] * a[0] + h.of[r][1] * a[1] + h.of[r][2] * a[2] + a[r];
    strain = along[0] * along[0] + along[1] * along[1] + along[2] * along[2] - 1.0;
  }
  /// Computes F a, S and S'.
  template <typename L>
  PALPATE_INLINE void find(const LaneModuli<L>& m, const LaneMatrix<L>& h, L (&along)[3], L& pull, L& slope) const {
    L strain, grown = L{} + 1.0, steeper{};
    stretch(h, along, strain);
    if (fibres_.exponent > 0) {
      const L none{}, y = strain > 0.0 ? fibres_.exponent * strain * strain : none;
      const L within = y < kLogGrowthMax ? y : none + kLogGrowthMax;
      L power;
      lane_exps(within, power);
      grown = power * (1.0 + (y - within));
      steeper = 2.0 * y * power;
    }
    const L twice = 2.0 * fibres_.share * m.mu;
    pull = twice * strain * grown;
    slope = twice * (grown + steeper);
  }

  Fibres fibres_;
};

}  // namespace palpate
