// The viscous stress of a solid (Kelvin and Voigt), in every lane.
//
//     P_v = F (2 mu_v E' + lambda_v tr(E') 1),   E' = sym(F^T F') the rate of Green's strain   [Pa]
//     A_v dF' = mu_v (F F^T dF' + F dF'^T F) + lambda_v (F : dF') F     its derivative by F' at fixed F
//
// mu_v = t mu_L, lambda_v = t lambda_L [Pa s], t the damping time [s]: at rest it is t times the elastic tangent
// (stiffness-proportional Rayleigh damping). It never resists a rigid motion and never gives energy: P_v : F' >= 0.
#pragma once

#include "common/mechanics/tangent.hpp"

namespace palpate {

/// p += P_v, in the precision of L.
template <typename L>
PALPATE_INLINE void add_viscous_stress(const L& mu, const L& lambda, const LaneMatrix<L>& f, const LaneMatrix<L>& rate,
                                       LaneMatrix<L>& p) {
  LaneMatrix<L> c;
  transposed_product(f, rate, c);
  const L volume = lambda * (c.of[0][0] + c.of[1][1] + c.of[2][2]);
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      L sum = f.of[r][s] * volume;
      for (int k = 0; k < 3; ++k) sum += f.of[r][k] * (mu * (c.of[k][s] + c.of[s][k]));
      p.of[r][s] += sum;
    }
}

/// a += A_v
template <typename L>
PALPATE_INLINE void add_viscous_tangent(const L& mu, const L& lambda, const LaneMatrix<L>& f, Tangent<L>& a) {
  LaneMatrix<L> left;
  product_with_transposed(f, f, left);
  for (auto& row : left.of)
    for (L& entry : row) entry *= mu;
  a.add_left(left);
  a.add_cross(mu, f);
  a.add_outer(lambda, f);
}

}  // namespace palpate
