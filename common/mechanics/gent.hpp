// Gent's law for a compressible solid: its chains cannot be stretched beyond a limit.
//
//     Psi = -mu_L J_m / 2 ln(1 - I_1 / J_m) + lambda/2 (J - 1)^2   [J/m^3]
//     I_1 = |F|^2 - 3 - 2 (J - 1),   lambda = lambda_L + mu_L,   J_m = `shape`: the I_1 at which stress would be infinite
//
//     P = mu_L e (F - G) + lambda (J - 1) G,   e(I_1) = 1 / (1 - I_1 / J_m)
//     A dF = mu_L [e (dF - X) + 2 e' (W : dF) W] + lambda [(J - 1) X + (G : dF) G],   W = F - G,  X = X(F)[dF],  e' = e^2 / J_m
//
// Beyond I_1 = kGentEnd J_m the tangent of e continues it, so that P and A are finite for every F. Where J = 1, I_1 is the
// invariant of Gent's law; its gradient vanishes at rest, as for the laws of both invariants (two_invariants.hpp).
//
// Source: Gent, A new constitutive relation for rubber, Rubber Chem. Technol. 69 (1996).
#pragma once

#include "common/mechanics/law.hpp"

namespace palpate {

/// Share of J_m up to which the law is Gent's: there e is 4, and e' 16 / J_m.
inline constexpr double kGentEnd = 0.75;

struct Gent {
  static constexpr SolidLaw kKind = SolidLaw::gent;
  static constexpr bool kSinglePrecision = false;
  explicit Gent(const LawParameters& of) : limit_(of.shape) {}

  template <typename L>
  PALPATE_INLINE void energy(const LaneModuli<L>& m, const LaneMatrix<L>& h, L& psi) const {
    const Values<L> at(h);
    L within, growth, slope, grown;
    find(at.first, within, growth, slope);
    lane_logs(1.0 - within / limit_, grown);
    const L beyond = at.first - within, to_end = growth - slope * beyond;
    const L stored = beyond * (to_end + 0.5 * slope * beyond) - limit_ * grown;
    psi = 0.5 * (m.mu * stored + (m.lambda + m.mu) * at.more * at.more);
  }

  template <typename L>
  PALPATE_INLINE void add_stress(const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) const {
    const Values<L> at(h);
    L within, growth, slope;
    find(at.first, within, growth, slope);
    const L by_f = m.mu * growth, by_g = (m.lambda + m.mu) * at.more - by_f;
    for (int k = 0; k < 9; ++k) p.of[k / 3][k % 3] += by_f * at.f.of[k / 3][k % 3] + by_g * at.g.of[k / 3][k % 3];
  }

  template <typename L>
  PALPATE_INLINE void add_tangent(const LaneModuli<L>& m, const LaneMatrix<L>& h, Tangent<L>& a) const {
    const Values<L> at(h);
    L within, growth, slope;
    find(at.first, within, growth, slope);
    const L by_f = m.mu * growth, lambda = m.lambda + m.mu;
    LaneMatrix<L> way;
    for (int k = 0; k < 9; ++k) way.of[k / 3][k % 3] = at.f.of[k / 3][k % 3] - at.g.of[k / 3][k % 3];
    a.add_identity(by_f);
    a.add_outer(2.0 * m.mu * slope, way);
    a.add_outer(lambda, at.g);
    a.add_cofactors(lambda * at.more - by_f, at.f);
  }

 private:
  template <typename L>
  struct Values {
    LaneMatrix<L> f, g;
    L more, first;  ///< J - 1, I_1

    PALPATE_INLINE explicit Values(const LaneMatrix<L>& h) {
      deformation_gradient(h, f);
      cofactors(f, g);
      determinant(f, g, more);
      inner(f, f, first);
      more -= 1.0;
      first -= 3.0 + 2.0 * more;
    }
  };
  /// Computes the part of I_1 for which the law is Gent's, e and e'.
  template <typename L>
  PALPATE_INLINE void find(const L& first, L& within, L& growth, L& slope) const {
    const L end = L{} + kGentEnd * limit_;
    within = first < end ? first : end;
    const L of_gent = 1.0 / (1.0 - within / limit_);
    slope = of_gent * of_gent * (1.0 / limit_);
    growth = of_gent + slope * (first - within);
  }

  double limit_;
};

}  // namespace palpate
