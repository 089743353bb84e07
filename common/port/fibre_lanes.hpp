// Fibres with one common direction at rest, the unit vector a, added to the law of a solid: transversely isotropic.
//
//     Psi_f = k/(2 b) h(b E^2) where they are longer than at rest, k/2 E^2 where shorter,   E = |F a|^2 - 1   [J/m^3]
//     P = S (F a) a^T,   S = 2 dPsi_f/dE
//     dP = dF S a a^T + 2 S' (Q : dF) Q,   Q = (F a) a^T,   S' = dS/dE
//
// h the integral of e, the exponential with its tangent beyond kLogGrowthMax (solid_law.hpp; b = 0: Psi_f = k/2 E^2): in
// extension S = 2 k E e(b E^2), else 2 k E. k: modulus of the fibres [Pa], b: no unit. They have no stress at rest, and S has no
// kink there or where fibres reverse. For small strains along them Young's modulus is larger by 4 k.
//
// Source: Weiss, Maker and Govindjee, Finite element implementation of incompressible, transversely isotropic hyperelasticity,
// CMAME 135 (1996); the exponential of the square from Holzapfel, Gasser and Ogden, J. Elasticity 61 (2000).
#pragma once

#include <Eigen/Core>

#include "common/port/exp_lanes.hpp"
#include "common/port/mat_lanes.hpp"
#include "common/mechanics/solid_law.hpp"

namespace palpate {

template <std::size_t N>
struct FibrePull {
  Doubles<N> along[3];     ///< F a
  Doubles<N> pull, slope;  ///< S, S'
};

/// `k`: in the unit of stress.
template <std::size_t N>
PALPATE_INLINE void find_fibres(const Fibres& fibres, const Doubles<N>& k, const Mat<N>& f, FibrePull<N>& at) {
  const auto& a = fibres.direction;
  for (int r = 0; r < 3; ++r) at.along[r] = f.of[r][0] * a[0] + f.of[r][1] * a[1] + f.of[r][2] * a[2];
  const Doubles<N> strain = at.along[0] * at.along[0] + at.along[1] * at.along[1] + at.along[2] * at.along[2] - 1.0;
  Doubles<N> grown = Doubles<N>{} + 1.0, steeper = Doubles<N>{};
  if (fibres.exponent > 0) {
    const Doubles<N> none{}, y = strain > 0.0 ? fibres.exponent * strain * strain : none;
    const Doubles<N> within = y < kLogGrowthMax ? y : none + kLogGrowthMax;
    Doubles<N> power;
    exps<N>(within, power);
    grown = power * (1.0 + (y - within));
    steeper = 2.0 * y * power;
  }
  at.pull = 2.0 * k * strain * grown;
  at.slope = 2.0 * k * (grown + steeper);
}

/// Adds P to p.
template <std::size_t N>
PALPATE_INLINE void add_fibres(const Fibres& fibres, const Doubles<N>& k, const Mat<N>& f, Mat<N>& p) {
  FibrePull<N> at;
  find_fibres<N>(fibres, k, f, at);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) p.of[r][c] += at.pull * at.along[r] * fibres.direction[static_cast<std::size_t>(c)];
}

/// Returns Psi_f at E = `strain`.
inline double fibre_energy(const Fibres& fibres, double k, double strain) {
  if (fibres.exponent == 0 || strain <= 0) return 0.5 * k * strain * strain;
  return 0.5 * k / fibres.exponent * growth_integral(fibres.exponent * strain * strain);
}

/// Stress of fibres at one F; `k` in the unit of stress.
struct FibreStress {
  FibreStress(const Fibres& fibres, double k, const Eigen::Matrix3d& f) : a(fibres.direction.data()), along(f * a) {
    FibrePull<2> at;
    Mat<2> lanes;
    for (int i = 0; i < 9; ++i) lanes.of[i / 3][i % 3] = Doubles<2>{} + f(i / 3, i % 3);
    find_fibres<2>(fibres, Doubles<2>{} + k, lanes, at);
    pull = at.pull[0], slope = at.slope[0];
    energy = fibre_energy(fibres, k, along.squaredNorm() - 1);
  }
  /// P
  Eigen::Matrix3d stress() const { return pull * along * a.transpose(); }

  Eigen::Vector3d a, along;                ///< a, F a
  double pull = 0, slope = 0, energy = 0;  ///< S, S', Psi_f
};

}  // namespace palpate
