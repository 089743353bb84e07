// Laws of both invariants: those of Mooney and Rivlin and of Veronda and Westmann for a compressible solid.
//
//     Psi = mu_1/(2 b) h(b I_1) + mu_2/2 I_2 + lambda/2 (J - 1)^2   [J/m^3];   b = 0: mu_1/2 I_1 + ...
//     I_1 = |F|^2 - 3 - 2 (J - 1),   I_2 = |G|^2 - 3 - 4 (J - 1),   mu_1 = mu_L - mu_2,   lambda = lambda_L + mu_1
//     h(y) the integral from 0 of e(y) = exp y, continued along its tangent beyond kLogGrowthMax (solid_law.hpp)
//
//     mooney_rivlin     b = 0, mu_2 = s mu_L:   c_1 (I_1 - 3) + c_2 (I_2 - 3) with c_1 = (1 - s) mu_L / 2, c_2 = s mu_L / 2
//     veronda_westmann  mu_2 = -mu_L:           c_1 (exp(b (I_1 - 3)) - 1) - c_1 b/2 (I_2 - 3) with c_1 = mu_L / b
//
// Where J = 1 the invariants are those of Mooney and Rivlin minus their values at rest. Their gradients vanish at rest, so that
// no part of the law has stress there.
//
//     P = mu_1 e (F - G) + mu_2 (|F|^2 F - F F^T F - 2 G) + lambda (J - 1) G
//     A dF = mu_1 [e (dF - X) + 2 b e' (W : dF) W] + mu_2 [|F|^2 dF + 2 (F : dF) F - dF F^T F - F F^T dF - F dF^T F - 2 X]
//            + lambda [(J - 1) X + (G : dF) G],    W = F - G,  X = X(F)[dF]
//
// Source: Mooney, J. Appl. Phys. 11 (1940); Veronda and Westmann, Mechanical characterization of skin, J. Biomech. 3 (1970).
#pragma once

#include <algorithm>

#include "common/mechanics/law.hpp"

namespace palpate {

struct TwoInvariants {
  static constexpr bool kSinglePrecision = false;
  /// `second_share`: mu_2 / mu_L; `exponent`: b.
  TwoInvariants(double second_share, double exponent) : share_(second_share), exponent_(exponent) {}

  template <typename L>
  PALPATE_INLINE void energy(const LaneModuli<L>& m, const LaneMatrix<L>& h, L& psi) const {
    const Values<L> at(*this, h);
    L square, first = at.first;
    inner(at.g, at.g, square);
    if (exponent_ > 0)
      for (std::size_t l = 0; l < kLanes<L>; ++l) first[l] = growth_integral(exponent_ * at.first[l]) / exponent_;
    const L second = square - 3.0 - 4.0 * at.more, mu_1 = (1.0 - share_) * m.mu;
    psi = 0.5 * (mu_1 * first + share_ * m.mu * second + (m.lambda + mu_1) * at.more * at.more);
  }

  template <typename L>
  PALPATE_INLINE void add_stress(const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) const {
    const Values<L> at(*this, h);
    LaneMatrix<L> left;
    product_with_transposed(at.f, at.f, left);
    const L mu_1 = (1.0 - share_) * m.mu, mu_2 = share_ * m.mu, first = mu_1 * at.growth;
    const L by_f = first + mu_2 * at.square, by_g = (m.lambda + mu_1) * at.more - first - 2.0 * mu_2;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        p.of[r][c] += by_f * at.f.of[r][c] + by_g * at.g.of[r][c] -
                      mu_2 * (left.of[r][0] * at.f.of[0][c] + left.of[r][1] * at.f.of[1][c] + left.of[r][2] * at.f.of[2][c]);
  }

  template <typename L>
  PALPATE_INLINE void add_tangent(const LaneModuli<L>& m, const LaneMatrix<L>& h, Tangent<L>& a) const {
    const Values<L> at(*this, h);
    const L mu_1 = (1.0 - share_) * m.mu, mu_2 = share_ * m.mu, first = mu_1 * at.growth, lambda = m.lambda + mu_1;
    LaneMatrix<L> way, part;
    for (int k = 0; k < 9; ++k) way.of[k / 3][k % 3] = at.f.of[k / 3][k % 3] - at.g.of[k / 3][k % 3];
    a.add_outer(2.0 * mu_1 * at.slope, way);
    a.add_identity(first + mu_2 * at.square);
    a.add_outer(2.0 * mu_2, at.f);
    const L minus = -mu_2;
    transposed_product(at.f, at.f, part);
    for (auto& row : part.of)
      for (L& entry : row) entry *= minus;
    a.add_right(part);
    product_with_transposed(at.f, at.f, part);
    for (auto& row : part.of)
      for (L& entry : row) entry *= minus;
    a.add_left(part);
    a.add_cross(minus, at.f);
    a.add_outer(lambda, at.g);
    a.add_cofactors(lambda * at.more - first - 2.0 * mu_2, at.f);
  }

 private:
  template <typename L>
  struct Values {
    LaneMatrix<L> f, g;
    L square, more, first;  ///< |F|^2, J - 1, I_1
    L growth, slope;        ///< e, b e'

    PALPATE_INLINE Values(const TwoInvariants& law, const LaneMatrix<L>& h) {
      deformation_gradient(h, f);
      cofactors(f, g);
      determinant(f, g, more);
      inner(f, f, square);
      first = square - 1.0 - 2.0 * more;
      more -= 1.0;
      growth = L{} + 1.0;
      slope = L{};
      if (law.exponent_ == 0) return;
      const L y = law.exponent_ * first, most = L{} + kLogGrowthMax, within = y < kLogGrowthMax ? y : most;
      const L least = L{} - 700.0, clamped = within > least ? within : least;
      lane_exps(clamped, slope);
      growth = slope * (1.0 + (y - within));
      slope *= law.exponent_;
    }
  };
  double share_, exponent_;
};

struct MooneyRivlin : TwoInvariants {
  static constexpr SolidLaw kKind = SolidLaw::mooney_rivlin;
  explicit MooneyRivlin(const LawParameters& of) : TwoInvariants(of.shape, 0) {}
};

struct VerondaWestmann : TwoInvariants {
  static constexpr SolidLaw kKind = SolidLaw::veronda_westmann;
  explicit VerondaWestmann(const LawParameters& of) : TwoInvariants(-1, of.shape) {}
};

}  // namespace palpate
