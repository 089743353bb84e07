// The stable neo-Hookean law: smooth for every F, flat and inside out included, and without stress at rest.
//
//     Psi = mu/2 (I - 3) - mu/2 ln((I + 1) / 4) + lambda/2 ((J - alpha)^2 - (1 - alpha)^2)   [J/m^3],   I = |F|^2
//     mu = 4/3 mu_L,  lambda = lambda_L + 5/6 mu_L,  alpha = 1 + mu_L / lambda
//
// As a function of H = F - 1, without a difference of numbers that nearly cancel, so that single precision suffices:
//
//     j = J - 1 = tr H + tr cof H + det H,   x = I - 3 = 2 tr H + |H|^2,   G = (1 + tr H) 1 - H^T + cof H
//     Psi = mu/2 (x - ln(1 + x/4)) + lambda/2 j^2 - mu_L j
//     P = (mu_L + d) H + (mu_L - l) (H^T - cof H) + (d + l - (mu_L - l) tr H) 1,    d = mu x / (4 (4 + x)),  l = lambda j
//     A dF = mu (1 - 1/(4 + x)) dF + 2 mu / (4 + x)^2 (F : dF) F + lambda (G : dF) G + (lambda j - mu_L) X(F)[dF]
//
// Source: Smith, De Goes and Kim, Stable neo-Hookean flesh simulation, ACM Trans. Graph. 37 (2018).
#pragma once

#include "common/mechanics/law.hpp"

namespace palpate {

struct NeoHookean {
  static constexpr SolidLaw kKind = SolidLaw::neo_hookean;
  static constexpr bool kSinglePrecision = true;
  explicit NeoHookean(const LawParameters&) {}

  template <typename L>
  PALPATE_INLINE void energy(const LaneModuli<L>& m, const LaneMatrix<L>& h, L& psi) const {
    const Values<L> at(h);
    L grown;
    lane_logs(1.0 + 0.25 * at.x, grown);
    psi = (2.0 / 3) * m.mu * (at.x - grown) + at.j * (0.5 * (m.lambda + (5.0 / 6) * m.mu) * at.j - m.mu);
  }

  template <typename L>
  PALPATE_INLINE void add_stress(const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) const {
    using Number = LaneNumber<L>;
    const Values<L> at(h);
    const L of_volume = (m.lambda + Number(5.0 / 6) * m.mu) * at.j;
    const L d = Number(1.0 / 3) * m.mu * at.x / (Number(4) + at.x), by_h = m.mu + d, by_rest = m.mu - of_volume;
    const L diagonal = d + of_volume - by_rest * at.trace;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) p.of[r][c] += by_h * h.of[r][c] + by_rest * (h.of[c][r] - at.cofactor.of[r][c]);
    for (int r = 0; r < 3; ++r) p.of[r][r] += diagonal;
  }

  template <typename L>
  PALPATE_INLINE void add_tangent(const LaneModuli<L>& m, const LaneMatrix<L>& h, Tangent<L>& a) const {
    const Values<L> at(h);
    LaneMatrix<L> f, g;
    deformation_gradient(h, f);
    cofactors(f, g);
    const L i = 4.0 + at.x, mu = (4.0 / 3) * m.mu, lambda = m.lambda + (5.0 / 6) * m.mu;
    a.add_identity(mu * (1.0 - 1.0 / i));
    a.add_outer(2.0 * mu / (i * i), f);
    a.add_outer(lambda, g);
    a.add_cofactors(lambda * at.j - m.mu, f);
  }

 private:
  template <typename L>
  struct Values {
    LaneMatrix<L> cofactor;  ///< cof H
    L trace, x, j;

    PALPATE_INLINE explicit Values(const LaneMatrix<L>& h) {
      using Number = LaneNumber<L>;
      L det, square;
      cofactors(h, cofactor);
      determinant(h, cofactor, det);
      inner(h, h, square);
      trace = h.of[0][0] + h.of[1][1] + h.of[2][2];
      x = Number(2) * trace + square;
      j = trace + (cofactor.of[0][0] + cofactor.of[1][1] + cofactor.of[2][2] + det);
    }
  };
};

}  // namespace palpate
