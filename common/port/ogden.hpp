// Ogden's law with two terms for a compressible solid.
//
//     Psi = sum_p mu_p / alpha_p (l_1^alpha_p + l_2^alpha_p + l_3^alpha_p - 3) - mu_s (J - 1) + lambda/2 (J - 1)^2   [J/m^3]
//     l_i principal stretches, J = det F, mu_s = mu_1 + mu_2, lambda = lambda_L + mu_s
//     mu_p = 2 mu_L s_p / alpha_p, s_2 = `shape`, s_1 = 1 - s_2: the terms' parts of the shear modulus of small strains
//
// Of C = F^T F, principal values x_i = l_i^2, vectors v_i, it is the function
//     P = F g(C) + (lambda (J - 1) - mu_s) G,   g(x) = sum_p mu_p x^beta_p,   beta_p = alpha_p / 2 - 1,   G the cofactors of F
// so that no square root of C is needed and F may be flat or inside out: x^beta is continued along its tangent below x = 0.04 (l
// = 0.2) and where it has grown by e^4 (kLogGrowthMax), which keeps P smooth in F and every element's stiffness finite. alpha =
// (2) is mooney_rivlin without a second share, alpha = (2, -2) with a second share is that of Mooney and Rivlin where J = 1.
//
// With y_i = F v_i and g[x, y] = (g(x) - g(y)) / (x - y), g[x, x] = g'(x), the tangent is (tetra_kernel.hpp has its form)
//     dP = dF g(C) + sum_{i <= j} c_ij (Q_ij : dF) Q_ij + (lambda (J - 1) - mu_s) X(F)[dF] + lambda (G : dF) G
//     Q_ii = y_i v_i^T, c_ii = 2 g'(x_i);   Q_ij = y_i v_j^T + y_j v_i^T, c_ij = g[x_i, x_j]
//
// In lanes g(C) = g(a) + g[a, b] (C - a) + g[a, b, c] (C - a)(C - b), Newton's interpolation at the x_i, which needs no v_i:
// differences of numbers that nearly cancel come from the binomial series. The x_i come from the roots of t^3 - 3 t - 2 r: the
// isolated one by Newton's method, the others by the remaining square root; where that is not sharp g(C) is, by the theorem of
// Cayley and Hamilton.
//
// Source: Ogden, Large deformation isotropic elasticity, Proc. R. Soc. A 326 (1972); the form of the part that changes volume as
// in Smith, De Goes and Kim (2018).
#pragma once

#include "common/mechanics/solid_law.hpp"
#include "common/port/exp_lanes.hpp"
#include "common/port/mat_lanes.hpp"

#include <Eigen/Core>

namespace palpate {

/// mu_p x^beta_p, exact for x from `low` to `high`, along its tangents outside.
struct PortOgdenTerm {
  double weight = 0;  ///< mu_p / mu_L
  double power = 0;   ///< beta_p
  double low = 1, high = 1, log_low = 0, log_high = 0;
};

/// Parameters of Ogden's law in units of mu_L.
struct OgdenLaw {
  OgdenLaw() = default;
  /// `law` of kind ogden.
  explicit OgdenLaw(const LawParameters& law);
  std::array<PortOgdenTerm, 2> terms;
  double sum = 0;  ///< mu_s / mu_L
};

/// Moduli mu_L and lambda of the law.
struct OgdenModuli {
  double mu, lambda;
};
double ogden_energy(const OgdenLaw& law, OgdenModuli moduli, const Eigen::Matrix3d& f);
Eigen::Matrix3d ogden_stress(const OgdenLaw& law, OgdenModuli moduli, const Eigen::Matrix3d& f);

/// The parts of dP but that of det F, with kappa = lambda (J - 1) - mu_s.
struct OgdenTangent {
  Eigen::Matrix3d g_of_c;
  std::array<double, 6> c;
  std::array<Eigen::Matrix3d, 6> q;
  double kappa;
  double steepest;  ///< bound of all parts but lambda (G : dF) G for a dF of length 1
};
OgdenTangent ogden_tangent(const OgdenLaw& law, OgdenModuli moduli, const Eigen::Matrix3d& f);

/// Values at principal stretches s, some of which may be negative: g, g' at s_i^2, and g[x_j, x_k] of the two others.
struct OgdenPrincipal {
  Eigen::Vector3d g, slope, between;
};
OgdenPrincipal ogden_principal(const OgdenLaw& law, double mu, const Eigen::Vector3d& x);

/// mu_p-weighted values at x_0, x_1, x_2.
template <std::size_t N>
struct PortOgdenTermAt {
  Doubles<N> value[3], slope[3];
  Truths<N> inside[3];  ///< true where the power itself is used
};

/// Range of x in which powers are used for every alpha; outside, their tangents.
inline constexpr double kPortSquaredStretchMin = 0.04;  ///< a stretch of 0.2
inline constexpr double kPortSquaredStretchMax = 1e6;   ///< a stretch of 1000, beyond any deformation of a body

template <std::size_t N>
PALPATE_INLINE void clamp_lanes(const Doubles<N>& x, double low, double high, Doubles<N>& y) {
  y = x < low ? Doubles<N>{} + low : x;
  y = y > high ? Doubles<N>{} + high : y;
}

template <std::size_t N>
PALPATE_INLINE void find_term(const PortOgdenTerm& term, const Doubles<N> (&x)[3], const Doubles<N> (&log_x)[3],
                              PortOgdenTermAt<N>& at) {
  for (int i = 0; i < 3; ++i) {
    Doubles<N> edge, log_edge, y;
    clamp_lanes<N>(x[i], term.low, term.high, edge);
    clamp_lanes<N>(log_x[i], term.log_low, term.log_high, log_edge);
    exps<N>(term.power * log_edge, y);
    y *= term.weight;
    at.slope[i] = term.power * y / edge;
    at.value[i] = y + at.slope[i] * (x[i] - edge);
    at.inside[i] = edge == x[i];
  }
}

/// Limit of |x_i - x_j| / x_j: up to it the binomial series, accurate to 4e-12, beyond it the quotient, to 2e-12.
inline constexpr double kPortSeriesGapMax = 1e-3;

/// Computes g[x_i, x_j]; `way`: (x_i - x_j) / x_j where that is small, `near`, else 0.
template <std::size_t N>
PALPATE_INLINE void first_difference(const PortOgdenTerm& term, const Doubles<N> (&x)[3], const PortOgdenTermAt<N>& at, int i,
                                     int j, Doubles<N>& way, Truths<N>& near, Doubles<N>& first) {
  const Doubles<N> apart = x[i] - x[j], size = apart < 0.0 ? -apart : apart;
  near = size <= kPortSeriesGapMax * x[j];
  const Doubles<N> base = x[j] > 0.0 ? x[j] : Doubles<N>{} + 1.0, divisor = near ? Doubles<N>{} + 1.0 : apart;
  way = near ? apart / base : Doubles<N>{};
  const double b = term.power;
  const Doubles<N> series =
      1.0 + (b - 1) / 2 * way * (1.0 + (b - 2) / 3 * way * (1.0 + (b - 3) / 4 * way * (1.0 + (b - 4) / 5 * way)));
  const Doubles<N> close = at.inside[j] ? at.slope[j] * series : at.slope[j];
  first = near ? close : (at.value[i] - at.value[j]) / divisor;
}

/// Computes the principal values of a positive semi-definite matrix: two that may be close to one another, and the third.
template <std::size_t N>
PALPATE_INLINE void principal_values(const Mat<N>& c, Doubles<N> (&x)[3]) {
  constexpr double kDeviatorCubeMin = 1e-30;  // below, the x agree to 1e-10 and r would be rounding
  const Doubles<N> middle = (c.of[0][0] + c.of[1][1] + c.of[2][2]) * (1.0 / 3);
  Mat<N> b = c, g;
  for (int k = 0; k < 3; ++k) b.of[k][k] -= middle;
  Doubles<N> square, size, det, root;
  inner(b, b, square);
  square *= 1.0 / 6;
  roots<N>(square, size);
  cofactors(b, g);
  determinant(b, g, det);
  const Doubles<N> cube = size * square, none = Doubles<N>{};
  Doubles<N> r = 0.5 * det / (cube > kDeviatorCubeMin ? cube : none + 1.0);
  const Truths<N> turned = r < 0.0;
  r = turned ? -r : r;
  r = r > 1.0 ? none + 1.0 : r;
  Doubles<N> t = none + 2.0;
  for (int k = 0; k < 5; ++k) {
    const Doubles<N> tt = t * t;
    t -= (t * (tt - 3.0) - 2.0 * r) / (3.0 * (tt - 1.0));
  }
  const Doubles<N> left = 12.0 - 3.0 * t * t;
  roots<N>(left > 0.0 ? left : none, root);
  const Doubles<N> sign = turned ? -size : size;
  x[0] = middle + sign * (0.5 * (root - t));
  x[1] = middle - sign * (0.5 * (root + t));
  x[2] = middle + sign * t;
  for (int i = 0; i < 3; ++i) x[i] = x[i] > 0.0 ? x[i] : none;
}

template <std::size_t N>
PALPATE_INLINE void log_squares(const Doubles<N> (&x)[3], Doubles<N> (&log_x)[3]) {
  for (int i = 0; i < 3; ++i) {
    Doubles<N> within;
    clamp_lanes<N>(x[i], kPortSquaredStretchMin, kPortSquaredStretchMax, within);
    logs<N>(within, log_x[i]);
  }
}

template <std::size_t N>
PALPATE_INLINE void right_cauchy_green(const Mat<N>& f, Mat<N>& c) {
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) c.of[r][s] = f.of[0][r] * f.of[0][s] + f.of[1][r] * f.of[1][s] + f.of[2][r] * f.of[2][s];
}

/// p += P
template <std::size_t N>
PALPATE_INLINE void add_ogden(const OgdenLaw& law, const Doubles<N>& mu, const Doubles<N>& lambda, const Mat<N>& f, Mat<N>& p) {
  Mat<N> c, cofactor;
  right_cauchy_green(f, c);
  Doubles<N> x[3], log_x[3], j;
  principal_values(c, x);
  log_squares<N>(x, log_x);
  Doubles<N> none{}, d0 = none, d1 = none, d2 = none;
  for (const PortOgdenTerm& term : law.terms) {
    if (term.weight == 0) continue;
    PortOgdenTermAt<N> at;
    find_term<N>(term, x, log_x, at);
    Doubles<N> way_0, way_2, first_01, first_21;
    Truths<N> near_0, near_2;
    first_difference<N>(term, x, at, 0, 1, way_0, near_0, first_01);
    first_difference<N>(term, x, at, 2, 1, way_2, near_2, first_21);
    const Truths<N> near = near_0 & near_2;
    const double b = term.power;
    const Doubles<N> base = x[1] > 0.0 ? x[1] : none + 1.0;
    const Doubles<N> close =
        at.slope[1] * ((b - 1) / 2) / base *
        (1.0 + (b - 2) / 3 * (way_0 + way_2) + (b - 2) * (b - 3) / 12 * (way_0 * way_0 + way_0 * way_2 + way_2 * way_2));
    const Doubles<N> apart = x[2] - x[0], far = (first_21 - first_01) / (near ? none + 1.0 : apart);
    d0 += at.value[0];
    d1 += first_01;
    d2 += near ? (at.inside[1] ? close : none) : (apart == 0.0 ? none : far);
  }
  d0 *= mu, d1 *= mu, d2 *= mu;
  // g(C) = d0 + (C - x_0) (d1 + d2 (C - x_1))
  Mat<N> inner_part, g;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      inner_part.of[r][s] = d2 * c.of[r][s];
      if (r == s) inner_part.of[r][s] += d1 - d2 * x[1];
    }
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      g.of[r][s] = c.of[r][0] * inner_part.of[0][s] + c.of[r][1] * inner_part.of[1][s] + c.of[r][2] * inner_part.of[2][s] -
                   x[0] * inner_part.of[r][s];
      if (r == s) g.of[r][s] += d0;
    }
  cofactors(f, cofactor);
  determinant(f, cofactor, j);
  const Doubles<N> pressure = lambda * (j - 1.0) - law.sum * mu;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s)
      p.of[r][s] += f.of[r][0] * g.of[0][s] + f.of[r][1] * g.of[1][s] + f.of[r][2] * g.of[2][s] + pressure * cofactor.of[r][s];
}

/// Computes Psi.
template <std::size_t N>
PALPATE_INLINE void ogden_energies(const OgdenLaw& law, const Doubles<N>& mu, const Doubles<N>& lambda, const Mat<N>& f,
                                   Doubles<N>& energy) {
  Mat<N> c, cofactor;
  right_cauchy_green(f, c);
  Doubles<N> x[3], log_x[3], j;
  principal_values(c, x);
  log_squares<N>(x, log_x);
  energy = Doubles<N>{};
  for (const PortOgdenTerm& term : law.terms)
    for (int i = 0; i < 3 && term.weight != 0; ++i) {
      Doubles<N> edge, log_edge, y;
      clamp_lanes<N>(x[i], term.low, term.high, edge);
      clamp_lanes<N>(log_x[i], term.log_low, term.log_high, log_edge);
      exps<N>(term.power * log_edge, y);
      const Doubles<N> beyond = x[i] - edge;
      energy += 0.5 * term.weight * ((edge * y - 1.0) / (term.power + 1) + beyond * (y + 0.5 * term.power * y / edge * beyond));
    }
  cofactors(f, cofactor);
  determinant(f, cofactor, j);
  const Doubles<N> more = j - 1.0;
  energy = mu * (energy - law.sum * more) + 0.5 * lambda * more * more;
}

}  // namespace palpate
