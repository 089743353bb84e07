// The corotational law: linear elasticity in the frame that rotates with each element.
//
//     Psi = mu |F - R|^2 + lambda/2 c^2   [J/m^3],   c = tr(R^T F) - 3,   mu = mu_L,  lambda = lambda_L
//     P = 2 mu (F - R) + lambda c R
//     A dF = 2 mu dF + lambda (R : dF) R + (lambda c - 2 mu) R [W t]x,   W = ((tr S) 1 - S)^-1,  S = R^T F,
//            t the axial part of R^T dF
//
// R is the rotation of the polar decomposition (polar_lanes.hpp), det R = 1 always. Pairs of principal stretches that add up to
// less than kLeastPairSum count as that in W: R flips where such a sum vanishes.
//
// Source: Mueller and Gross, Interactive virtual materials, Graphics Interface (2004).
#pragma once

#include "common/mechanics/law.hpp"
#include "common/mechanics/polar.hpp"
#include "common/mechanics/polar_lanes.hpp"

namespace palpate {

/// Computes W of the symmetric S, lane `lane` alone, with its limit.
void limited_pair_sums(const double (&s)[9], double (&w)[9]);

struct Corotational {
  static constexpr SolidLaw kKind = SolidLaw::corotational;
  static constexpr bool kSinglePrecision = false;
  explicit Corotational(const LawParameters&) {}

  template <typename L>
  PALPATE_INLINE void energy(const LaneModuli<L>& m, const LaneMatrix<L>& h, L& psi) const {
    LaneMatrix<L> f, r;
    deformation_gradient(h, f);
    polar_rotations(f, r);
    L trace, square;
    inner(r, f, trace);
    for (int k = 0; k < 9; ++k) f.of[k / 3][k % 3] -= r.of[k / 3][k % 3];
    inner(f, f, square);
    psi = m.mu * square + 0.5 * m.lambda * (trace - 3.0) * (trace - 3.0);
  }

  template <typename L>
  PALPATE_INLINE void add_stress(const LaneModuli<L>& m, const LaneMatrix<L>& h, LaneMatrix<L>& p) const {
    LaneMatrix<L> f, r;
    deformation_gradient(h, f);
    polar_rotations(f, r);
    L trace;
    inner(r, f, trace);
    const L by_f = 2.0 * m.mu, by_r = m.lambda * (trace - 3.0) - by_f;
    for (int k = 0; k < 9; ++k) p.of[k / 3][k % 3] += by_f * f.of[k / 3][k % 3] + by_r * r.of[k / 3][k % 3];
  }

  template <typename L>
  PALPATE_INLINE void add_tangent(const LaneModuli<L>& m, const LaneMatrix<L>& h, Tangent<L>& a) const {
    LaneMatrix<L> f, r, s, w;
    deformation_gradient(h, f);
    polar_rotations(f, r);
    transposed_product(r, f, s);
    const L trace = s.of[0][0] + s.of[1][1] + s.of[2][2], by_turn = m.lambda * (trace - 3.0) - 2.0 * m.mu;
    inverse_pair_sums(s, w);
    a.add_identity(2.0 * m.mu);
    a.add_outer(m.lambda, r);
    // R [W t]x = sum_kl W_kl t_l E_k,  E_k = R [e_k]x,  t_l = E_l : dF
    LaneMatrix<L> e[3];
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) {
        e[k].of[i][k] = L{};
        e[k].of[i][(k + 1) % 3] = r.of[i][(k + 2) % 3];
        e[k].of[i][(k + 2) % 3] = -r.of[i][(k + 1) % 3];
      }
    for (int k = 0; k < 3; ++k) {
      LaneMatrix<L> sum;  // sum_l W_kl E_l
      for (int i = 0; i < 9; ++i)
        sum.of[i / 3][i % 3] = by_turn * (w.of[k][0] * e[0].of[i / 3][i % 3] + w.of[k][1] * e[1].of[i / 3][i % 3] +
                                          w.of[k][2] * e[2].of[i / 3][i % 3]);
      for (int i = 0; i < 9; ++i)
        for (int n = i; n < 9; ++n) a.at(i, n) += e[k].of[i / 3][i % 3] * sum.of[n / 3][n % 3];
    }
  }

 private:
  /// Computes W; a lane with a pair below the limit is computed by itself.
  template <typename L>
  PALPATE_INLINE static void inverse_pair_sums(const LaneMatrix<L>& s, LaneMatrix<L>& w) {
    LaneMatrix<L> pairs, g;
    L det;
    pair_sums(s, pairs);
    cofactors(pairs, g);
    determinant(pairs, g, det);
    for (int k = 0; k < 9; ++k) w.of[k / 3][k % 3] = g.of[k / 3][k % 3] / det;
    for (int k = 0; k < 3; ++k) pairs.of[k][k] -= kLeastPairSum;
    cofactors(pairs, g);
    determinant(pairs, g, det);
    const LaneTruths<L> apart = (pairs.of[0][0] > 0.0) & (g.of[2][2] > 0.0) & (det > 0.0);  // leading minors
    for (std::size_t l = 0; l < kLanes<L>; ++l) {
      if (apart[l]) continue;
      double lane[9], inverse[9];
      for (int k = 0; k < 9; ++k) lane[k] = s.of[k / 3][k % 3][l];
      limited_pair_sums(lane, inverse);
      for (int k = 0; k < 9; ++k) w.of[k / 3][k % 3][l] = inverse[k];
    }
  }
};

}  // namespace palpate
