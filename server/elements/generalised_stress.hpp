// The stress of an element's generalised gradient (F, q), one element in every lane (element_shape.hpp): of its mean deformation
// gradient F by the law, of its hourglass modes q by their stiffness k_a, and of both by viscosity.
//
//     (V P_v + sum_a q_a s_a^T, F s_a),   s_a = t k_a d(F^T q_a)/dt      viscous stress, t the damping time [s]
//
// Nothing here knows whether lanes are elements of one state, or changes of one element in many columns: the viscous stress is
// linear in the rate, so with the changes as rates it is the product with the tangent.
#pragma once

#include "common/mechanics/law.hpp"
#include "common/mechanics/viscosity.hpp"

namespace palpate {

/// (F, q), or its stress or rate.
template <typename L, int Columns>
struct LaneGradient {
  static constexpr int kModes = Columns - 3;
  L of[3][Columns];

  PALPATE_INLINE void mean(LaneMatrix<L>& f) const {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) f.of[r][c] = of[r][c];
  }
  PALPATE_INLINE void set_mean(const LaneMatrix<L>& f) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) of[r][c] = f.of[r][c];
  }
};

/// Moduli of an element for its viscous stress, and k_a, all multiplied by t.
template <typename L, int Modes>
struct LaneDamping {
  LaneModuli<L> moduli;  ///< multiplied by V
  L k[Modes + 1];        ///< the last is unused
};

/// p += viscous stress at (F, q).
template <typename L, int Columns>
PALPATE_INLINE void add_generalised_viscous_stress(const LaneDamping<L, Columns - 3>& damping, const LaneMatrix<L>& f,
                                                   const LaneGradient<L, Columns>& at, const LaneGradient<L, Columns>& rate,
                                                   LaneGradient<L, Columns>& p) {
  LaneMatrix<L> mean_rate, stress;
  rate.mean(mean_rate);
  p.mean(stress);
  add_viscous_stress(damping.moduli.mu, damping.moduli.lambda, f, mean_rate, stress);
  p.set_mean(stress);
  for (int a = 3; a < Columns; ++a)
    for (int m = 0; m < 3; ++m) {
      L s = rate.of[0][m] * at.of[0][a] + f.of[0][m] * rate.of[0][a];
      for (int r = 1; r < 3; ++r) s += rate.of[r][m] * at.of[r][a] + f.of[r][m] * rate.of[r][a];
      s *= damping.k[a - 3];
      for (int r = 0; r < 3; ++r) {
        p.of[r][m] += at.of[r][a] * s;
        p.of[r][a] += f.of[r][m] * s;
      }
    }
}

}  // namespace palpate
