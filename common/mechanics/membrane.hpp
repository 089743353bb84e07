// St. Venant and Kirchhoff's law in the plane of a membrane: it resists stretch and shear in its plane and no bending.
//
//     Psi = mu E : E + lambda/2 tr(E)^2   [J/m^2, moduli multiplied by the thickness],   E = (F^T F - 1)/2 in the plane
//     P = F S,   S = 2 mu E + lambda tr(E) 1 = (lambda tr(E) - mu) 1 + mu F^T F
//     A dF = dF S + lambda (F : dF) F + mu (F F^T dF + F dF^T F)
//
// F maps two directions: its columns span the deformed triangle and F n = 0 for the normal n at rest, so that |1|^2 = 2 in the
// plane. For plane stress lambda_L = E nu / (1 - nu^2). H = F - 1 as for other laws, with the 1 of three dimensions.
#pragma once

#include "common/mechanics/law.hpp"

namespace palpate {

struct Membrane {
  static constexpr SolidLaw kKind = SolidLaw::membrane;
  static constexpr bool kSinglePrecision = false;
  explicit Membrane(const LawParameters&) {}

  template <typename L>
  PALPATE_INLINE void energy(const LaneModuli<L>& m, const LaneMatrix<L>& h, L& psi) const {
    LaneMatrix<L> f, c;
    deformation_gradient(h, f);
    transposed_product(f, f, c);
    L square;
    inner(c, c, square);
    const L trace = c.of[0][0] + c.of[1][1] + c.of[2][2], strain = 0.5 * (trace - 2.0);
    psi = 0.25 * m.mu * (square - 2.0 * trace + 2.0) + 0.5 * m.lambda * strain * strain;
  }

  template <typename L>
  PALPATE_INLINE void add_stress(const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) const {
    LaneMatrix<L> f, s;
    deformation_gradient(h, f);
    stress_in_plane(m, f, s);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) p.of[r][c] += f.of[r][0] * s.of[0][c] + f.of[r][1] * s.of[1][c] + f.of[r][2] * s.of[2][c];
  }

  template <typename L>
  PALPATE_INLINE void add_tangent(const LaneModuli<L>& m, const LaneMatrix<L>& h, Tangent<L>& a) const {
    LaneMatrix<L> f, s, left;
    deformation_gradient(h, f);
    stress_in_plane(m, f, s);
    a.add_right(s);
    a.add_outer(m.lambda, f);
    product_with_transposed(f, f, left);
    for (auto& row : left.of)
      for (L& entry : row) entry *= m.mu;
    a.add_left(left);
    a.add_cross(m.mu, f);
  }

 private:
  /// Computes S.
  template <typename L>
  PALPATE_INLINE static void stress_in_plane(const LaneModuli<L>& m, const LaneMatrix<L>& f, LaneMatrix<L>& s) {
    transposed_product(f, f, s);
    const L by_one = 0.5 * m.lambda * (s.of[0][0] + s.of[1][1] + s.of[2][2] - 2.0) - m.mu;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) s.of[r][c] *= m.mu;
      s.of[r][r] += by_one;
    }
  }
};

}  // namespace palpate
