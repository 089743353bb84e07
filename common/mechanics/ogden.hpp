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
// With y_i = F v_i and g[x, y] = (g(x) - g(y)) / (x - y), g[x, x] = g'(x), the tangent is
//     A dF = dF g(C) + sum_{i <= j} c_ij (Q_ij : dF) Q_ij + (lambda (J - 1) - mu_s) X(F)[dF] + lambda (G : dF) G
//     Q_ii = y_i v_i^T, c_ii = 2 g'(x_i);   Q_ij = y_i v_j^T + y_j v_i^T, c_ij = g[x_i, x_j]
//
// For the stress g(C) = g(a) + g[a, b] (C - a) + g[a, b, c] (C - a)(C - b), Newton's interpolation at the x_i, which needs no
// v_i: differences of numbers that nearly cancel come from the binomial series. The x_i come from the roots of t^3 - 3 t - 2 r:
// the isolated one by Newton's method, the others by the remaining square root; where that is not sharp g(C) is, by the theorem
// of Cayley and Hamilton.
//
// Source: Ogden, Large deformation isotropic elasticity, Proc. R. Soc. A 326 (1972); the form of the part that changes volume as
// in Smith, De Goes and Kim (2018).
#pragma once

#include "common/mechanics/law.hpp"

namespace palpate {

/// mu_p x^beta_p, exact for x from `low` to `high`, along its tangents outside.
struct OgdenTerm {
  double weight = 0;  ///< mu_p / mu_L; 0: there is no such term
  double power = 0;   ///< beta_p
  double low = 1, high = 1, log_low = 0, log_high = 0;
};

/// mu_p-weighted values at x_0, x_1, x_2.
template <typename L>
struct OgdenTermAt {
  L value[3], slope[3];
  LaneTruths<L> inside[3];  ///< true where the power itself is used
};

/// Range of x in which powers are used for every alpha; outside, their tangents.
inline constexpr double kSquaredStretchMin = 0.04;  ///< a stretch of 0.2
inline constexpr double kSquaredStretchMax = 1e6;   ///< a stretch of 1000, beyond any deformation of a body

template <typename L>
PALPATE_INLINE void clamp_lanes(const L& x, double low, double high, L& y) {
  y = x < low ? L{} + low : x;
  y = y > high ? L{} + high : y;
}

template <typename L>
PALPATE_INLINE void find_term(const OgdenTerm& term, const L (&x)[3], const L (&log_x)[3], OgdenTermAt<L>& at) {
  for (int i = 0; i < 3; ++i) {
    L edge, log_edge, y;
    clamp_lanes(x[i], term.low, term.high, edge);
    clamp_lanes(log_x[i], term.log_low, term.log_high, log_edge);
    lane_exps(term.power * log_edge, y);
    y *= term.weight;
    at.slope[i] = term.power * y / edge;
    at.value[i] = y + at.slope[i] * (x[i] - edge);
    at.inside[i] = edge == x[i];
  }
}

/// Limit of |x_i - x_j| / x_j: up to it the binomial series, accurate to 4e-12, beyond it the quotient, to 2e-12.
inline constexpr double kSeriesGapMax = 1e-3;

/// Computes g[x_i, x_j]; `way`: (x_i - x_j) / x_j where that is small, `near`, else 0.
template <typename L>
PALPATE_INLINE void first_difference(const OgdenTerm& term, const L (&x)[3], const OgdenTermAt<L>& at, int i, int j, L& way,
                                     LaneTruths<L>& near, L& first) {
  const L apart = x[i] - x[j], size = apart < 0.0 ? -apart : apart;
  near = size <= kSeriesGapMax * x[j];
  const L base = x[j] > 0.0 ? x[j] : L{} + 1.0, divisor = near ? L{} + 1.0 : apart;
  way = near ? apart / base : L{};
  const double b = term.power;
  const L series = 1.0 + (b - 1) / 2 * way * (1.0 + (b - 2) / 3 * way * (1.0 + (b - 3) / 4 * way * (1.0 + (b - 4) / 5 * way)));
  const L close = at.inside[j] ? at.slope[j] * series : at.slope[j];
  first = near ? close : (at.value[i] - at.value[j]) / divisor;
}

/// Computes the principal values of a positive semi-definite matrix: two that may be close to one another, and the third.
template <typename L>
PALPATE_INLINE void principal_values(const LaneMatrix<L>& c, L (&x)[3]) {
  constexpr double kDeviatorCubeMin = 1e-30;  // below, the x agree to 1e-10 and r would be rounding
  const L middle = (c.of[0][0] + c.of[1][1] + c.of[2][2]) * (1.0 / 3);
  LaneMatrix<L> b = c, g;
  for (int k = 0; k < 3; ++k) b.of[k][k] -= middle;
  L square, size, det, root;
  inner(b, b, square);
  square *= 1.0 / 6;
  lane_roots(square, size);
  cofactors(b, g);
  determinant(b, g, det);
  const L cube = size * square, none = L{};
  L r = 0.5 * det / (cube > kDeviatorCubeMin ? cube : none + 1.0);
  const LaneTruths<L> turned = r < 0.0;
  r = turned ? -r : r;
  r = r > 1.0 ? none + 1.0 : r;
  L t = none + 2.0;
  for (int k = 0; k < 5; ++k) {
    const L tt = t * t;
    t -= (t * (tt - 3.0) - 2.0 * r) / (3.0 * (tt - 1.0));
  }
  const L left = 12.0 - 3.0 * t * t;
  lane_roots(left > 0.0 ? left : none, root);
  const L sign = turned ? -size : size;
  x[0] = middle + sign * (0.5 * (root - t));
  x[1] = middle - sign * (0.5 * (root + t));
  x[2] = middle + sign * t;
  for (int i = 0; i < 3; ++i) x[i] = x[i] > 0.0 ? x[i] : none;
}

template <typename L>
PALPATE_INLINE void log_squares(const L (&x)[3], L (&log_x)[3]) {
  for (int i = 0; i < 3; ++i) {
    L within;
    clamp_lanes(x[i], kSquaredStretchMin, kSquaredStretchMax, within);
    lane_logs(within, log_x[i]);
  }
}

class Ogden {
 public:
  static constexpr SolidLaw kKind = SolidLaw::ogden;
  static constexpr bool kSinglePrecision = false;
  explicit Ogden(const LawParameters& of);
  /// Returns mu_s / mu_L.
  double modulus_sum() const { return sum_; }

  template <typename L>
  PALPATE_INLINE void energy(const LaneModuli<L>& m, const LaneMatrix<L>& h, L& psi) const {
    const Values<L> at(h);
    L log_x[3];
    log_squares(at.x, log_x);
    L sum{};
    for (const OgdenTerm& term : terms_)
      for (int i = 0; i < 3 && term.weight != 0; ++i) {
        L edge, log_edge, y;
        clamp_lanes(at.x[i], term.low, term.high, edge);
        clamp_lanes(log_x[i], term.log_low, term.log_high, log_edge);
        lane_exps(term.power * log_edge, y);
        const L beyond = at.x[i] - edge;
        sum += 0.5 * term.weight * ((edge * y - 1.0) / (term.power + 1) + beyond * (y + 0.5 * term.power * y / edge * beyond));
      }
    const L more = at.j - 1.0;
    psi = m.mu * (sum - sum_ * more) + 0.5 * (m.lambda + sum_ * m.mu) * more * more;
  }

  template <typename L>
  PALPATE_INLINE void add_stress(const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) const {
    const Values<L> at(h);
    L log_x[3], d0{}, d1{}, d2{};
    log_squares(at.x, log_x);
    for (const OgdenTerm& term : terms_)
      if (term.weight != 0) add_differences(term, at.x, log_x, d0, d1, d2);
    d0 *= m.mu, d1 *= m.mu, d2 *= m.mu;
    // g(C) = d0 + (C - x_0) (d1 + d2 (C - x_1))
    LaneMatrix<L> inner_part, g;
    for (int r = 0; r < 3; ++r)
      for (int s = 0; s < 3; ++s) {
        inner_part.of[r][s] = d2 * at.c.of[r][s];
        if (r == s) inner_part.of[r][s] += d1 - d2 * at.x[1];
      }
    for (int r = 0; r < 3; ++r)
      for (int s = 0; s < 3; ++s) {
        g.of[r][s] = at.c.of[r][0] * inner_part.of[0][s] + at.c.of[r][1] * inner_part.of[1][s] +
                     at.c.of[r][2] * inner_part.of[2][s] - at.x[0] * inner_part.of[r][s];
        if (r == s) g.of[r][s] += d0;
      }
    const L pressure = (m.lambda + sum_ * m.mu) * (at.j - 1.0) - sum_ * m.mu;
    for (int r = 0; r < 3; ++r)
      for (int s = 0; s < 3; ++s)
        p.of[r][s] +=
            at.f.of[r][0] * g.of[0][s] + at.f.of[r][1] * g.of[1][s] + at.f.of[r][2] * g.of[2][s] + pressure * at.g.of[r][s];
  }

  /// Works lane by lane.
  template <typename L>
  PALPATE_INLINE void add_tangent(const LaneModuli<L>& m, const LaneMatrix<L>& h, Tangent<L>& a) const {
    for (std::size_t l = 0; l < kLanes<L>; ++l) {
      double of_h[9], more[Tangent<L>::kEntries];
      for (int k = 0; k < 9; ++k) of_h[k] = h.of[k / 3][k % 3][l];
      tangent_of_one(m.mu[l], m.lambda[l], of_h, more);
      for (int k = 0; k < Tangent<L>::kEntries; ++k) a.of[k][l] += more[k];
    }
  }

 private:
  template <typename L>
  struct Values {
    LaneMatrix<L> f, g, c;  ///< F, G, C
    L x[3], j;

    PALPATE_INLINE explicit Values(const LaneMatrix<L>& h) {
      deformation_gradient(h, f);
      transposed_product(f, f, c);
      principal_values(c, x);
      cofactors(f, g);
      determinant(f, g, j);
    }
  };

  /// Adds g(x_1 of the order 0, 1, 2), g[x_0, x_1] and g[x_0, x_1, x_2] of one term, without mu_L.
  template <typename L>
  PALPATE_INLINE static void add_differences(const OgdenTerm& term, const L (&x)[3], const L (&log_x)[3], L& d0, L& d1, L& d2) {
    OgdenTermAt<L> at;
    find_term(term, x, log_x, at);
    const L none{};
    L way_0, way_2, first_01, first_21;
    LaneTruths<L> near_0, near_2;
    first_difference(term, x, at, 0, 1, way_0, near_0, first_01);
    first_difference(term, x, at, 2, 1, way_2, near_2, first_21);
    const LaneTruths<L> near = near_0 & near_2;
    const double b = term.power;
    const L base = x[1] > 0.0 ? x[1] : none + 1.0;
    const L close =
        at.slope[1] * ((b - 1) / 2) / base *
        (1.0 + (b - 2) / 3 * (way_0 + way_2) + (b - 2) * (b - 3) / 12 * (way_0 * way_0 + way_0 * way_2 + way_2 * way_2));
    const L apart = x[2] - x[0], far = (first_21 - first_01) / (near ? none + 1.0 : apart);
    d0 += at.value[0];
    d1 += first_01;
    d2 += near ? (at.inside[1] ? close : none) : (apart == 0.0 ? none : far);
  }
  /// Computes the entries of A at one H.
  void tangent_of_one(double mu, double lambda, const double (&h)[9], double* a) const;

  std::array<OgdenTerm, 2> terms_;
  double sum_ = 0;  ///< mu_s / mu_L
};

}  // namespace palpate
