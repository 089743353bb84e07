// polar_rotation of common/mechanics/polar.hpp in every lane: the rotation R with the largest tr(R^T F), F of any kind.
//
// Its unit quaternion is the eigenvector, for the largest eigenvalue, of the symmetric 4x4 matrix K(F) with q.K q = tr(R(q)^T F).
// With F scaled to |F|^2 = 3, J = det F, G its cofactors and s_1 >= s_2 >= |s_3| its principal stretches, s_3 with the sign of J,
//     det(x - K) = x^4 - 6 x^2 - 8 J x + 9 - 4 |G|^2,   largest root x = s_1 + s_2 + s_3 in [1, 3],
//     slope there 8 (s_1 + s_2) (s_2 + s_3) (s_3 + s_1)
// 1. x by Halley's method from 3: all roots are real, so it descends to the largest and no further.
// 2. q is the largest column of the adjugate of x - K.
// 3. Where R^T F is not symmetric to rounding, Newton's method on rotations, of third order: a rotation about w by
//    atan |w|, ((tr S) I - S) w = t, S and t the symmetric and the axial part of R^T F.
// A lane that has converged stays unchanged while others continue: its numbers do not depend on theirs. R is the identity for F =
// 0; where s_2 + s_3 < 1e-6 |F| rounding chooses among rotations whose tr(R^T F) is the largest to 1e-6 |F|. Source: Horn,
// Closed-form solution of absolute orientation using unit quaternions, J. Opt. Soc. Am. A 4 (1987).
#pragma once

#include "common/port/mat_lanes.hpp"

namespace palpate {

/// w, x, y, z, of any length
template <std::size_t N>
struct Quaternion {
  Doubles<N> of[4];
};

/// Finds the largest root x of x^4 - 6 x^2 - 8 J x + c.
template <std::size_t N>
PALPATE_INLINE void largest_root(const Doubles<N>& j, const Doubles<N>& c, Doubles<N>& x) {
  constexpr int kStepsMax = 24;            // towards a double root each step leaves a third of the error
  constexpr double kLastStep = 2e-6;       // share of the slope: the third power of such a step is lost in rounding
  constexpr double kRootRounding = 3e-14;  // of p; at a double root x stays above it, where the adjugate is not rounding alone
  const Doubles<N> least = Doubles<N>{} + 1.0;
  x = least + 2.0;
  Truths<N> going = x > least;
  for (int k = 0; k < kStepsMax && any<N>(going); ++k) {
    const Doubles<N> square = x * x, p = ((square - 6.0) * x - 8.0 * j) * x + c;
    const Doubles<N> slope = 4.0 * ((square - 3.0) * x - 2.0 * j), curvature = 12.0 * (square - 1.0);
    const Doubles<N> step = 2.0 * p * slope / (2.0 * slope * slope - p * curvature), next = x - step;
    going &= p > kRootRounding;
    x = going ? (next > least ? next : least) : x;
    going &= step > kLastStep * slope;
  }
}

template <std::size_t N>
PALPATE_INLINE void adjugate(const Doubles<N> (&m)[4][4], Doubles<N> (&a)[4][4]) {
  Doubles<N> minors[2][4][4];  // of the upper and of the lower two rows, columns p < q
  for (int h = 0; h < 2; ++h)
    for (int p = 0; p < 4; ++p)
      for (int q = p + 1; q < 4; ++q) minors[h][p][q] = m[2 * h][p] * m[2 * h + 1][q] - m[2 * h][q] * m[2 * h + 1][p];
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c <= r; ++c) {
      const int p = c < 1 ? 1 : 0, q = c < 2 ? 2 : 1, s = c < 3 ? 3 : 2;
      const Doubles<N>* const row = m[r ^ 1];
      const auto& of = minors[r < 2 ? 1 : 0];
      const Doubles<N> minor = row[p] * of[q][s] - row[q] * of[p][s] + row[s] * of[p][q];
      a[r][c] = a[c][r] = (r + c) % 2 ? -minor : minor;
    }
}

/// Computes the largest column of the adjugate of x - K(F).
template <std::size_t N>
PALPATE_INLINE void eigenvector(const Mat<N>& f, const Doubles<N>& x, Quaternion<N>& q) {
  Doubles<N> m[4][4], a[4][4];
  const Doubles<N> trace = f.of[0][0] + f.of[1][1] + f.of[2][2];
  m[0][0] = x - trace;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    m[k + 1][k + 1] = x + trace - 2.0 * f.of[k][k];
    m[0][k + 1] = m[k + 1][0] = f.of[i][j] - f.of[j][i];
    m[i + 1][j + 1] = m[j + 1][i + 1] = -f.of[i][j] - f.of[j][i];
  }
  adjugate<N>(m, a);
  for (int r = 0; r < 4; ++r) q.of[r] = a[0][r];
  Doubles<N> largest = a[0][0];
  for (int c = 1; c < 4; ++c) {
    const Truths<N> larger = a[c][c] > largest;
    largest = larger ? a[c][c] : largest;
    for (int r = 0; r < 4; ++r) q.of[r] = larger ? a[c][r] : q.of[r];
  }
}

template <std::size_t N>
PALPATE_INLINE void rotation_of(const Quaternion<N>& q, Mat<N>& r) {
  const Doubles<N>&w = q.of[0], *const v = q.of + 1;
  const Doubles<N> twice = 2.0 / (w * w + v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    r.of[k][k] = 1.0 - twice * (v[i] * v[i] + v[j] * v[j]);
    r.of[i][j] = twice * (v[i] * v[j] - w * v[k]);
    r.of[j][i] = twice * (v[i] * v[j] + w * v[k]);
  }
}

/// Computes the axial part t of S.
template <std::size_t N>
PALPATE_INLINE void axial_part(const Mat<N>& s, Doubles<N> (&t)[3]) {
  for (int k = 0; k < 3; ++k) t[k] = s.of[(k + 2) % 3][(k + 1) % 3] - s.of[(k + 1) % 3][(k + 2) % 3];
}

/// Computes H = (tr S) I - S of the symmetric part of S; its eigenvalues are sums of two principal stretches.
template <std::size_t N>
PALPATE_INLINE void pair_sums(const Mat<N>& s, Mat<N>& h) {
  const Doubles<N> trace = s.of[0][0] + s.of[1][1] + s.of[2][2];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) h.of[r][c] = (r == c ? trace : Doubles<N>{}) - 0.5 * (s.of[r][c] + s.of[c][r]);
}

/// Rotates q, in the lanes that are `going`, by a step of Newton's method at S = R^T F.
template <std::size_t N>
PALPATE_INLINE void turn(const Mat<N>& s, const Doubles<N> (&t)[3], const Truths<N>& going, Quaternion<N>& q) {
  constexpr double kDetMin = 1e-13;  // limit of det H at |F|^2 = 3: below, rounding chooses among R, and q stays
  Mat<N> h, g;
  pair_sums(s, h);
  cofactors(h, g);
  Doubles<N> det, w[3], root;
  determinant(h, g, det);
  const Doubles<N> inverse = det > kDetMin ? 1.0 / det : Doubles<N>{};
  for (int k = 0; k < 3; ++k) w[k] = inverse * (g.of[k][0] * t[0] + g.of[k][1] * t[1] + g.of[k][2] * t[2]);
  roots<N>(1.0 + (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]), root);
  root += 1.0;
  const Quaternion<N> p = q;
  q.of[0] = going ? p.of[0] * root - (p.of[1] * w[0] + p.of[2] * w[1] + p.of[3] * w[2]) : p.of[0];
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const Doubles<N> turned = p.of[k + 1] * root + p.of[0] * w[k] + (p.of[i + 1] * w[j] - p.of[j + 1] * w[i]);
    q.of[k + 1] = going ? turned : p.of[k + 1];
  }
}

/// Refines R from a q that is nearly exact. |F|^2 = 3.
template <std::size_t N>
PALPATE_INLINE void refine(const Mat<N>& f, Quaternion<N>& q, Mat<N>& r) {
  constexpr int kNewtonStepsMax = 4;         // third order: two steps bring |w| = 1e-2 below rounding
  constexpr double kAxialSquareMin = 1e-29;  // limit of |t|^2: t of 3e-15, some roundings of R^T F
  Truths<N> going = f.of[0][0] == f.of[0][0];
  for (int k = 0;; ++k) {
    rotation_of(q, r);
    Mat<N> s;
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < 3; ++c) s.of[i][c] = r.of[0][i] * f.of[0][c] + r.of[1][i] * f.of[1][c] + r.of[2][i] * f.of[2][c];
    Doubles<N> t[3];
    axial_part(s, t);
    going &= t[0] * t[0] + t[1] * t[1] + t[2] * t[2] > kAxialSquareMin;
    if (k == kNewtonStepsMax || !any<N>(going)) return;
    turn(s, t, going, q);
  }
}

/// Computes R and its quaternion, of any length.
template <std::size_t N>
PALPATE_INLINE void polar_rotations(const Mat<N>& f, Quaternion<N>& q, Mat<N>& r) {
  constexpr double kSquareNormMin = 1e-290;  // limit of |F|^2: below, squares lose digits, and F counts as 0
  Doubles<N> square, size, j, minors, x;
  inner(f, f, square);
  roots<N>(square / 3.0, size);
  const Doubles<N> scale = square > kSquareNormMin ? 1.0 / size : Doubles<N>{};
  Mat<N> scaled, g;
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) scaled.of[i][c] = scale * f.of[i][c];
  cofactors(scaled, g);
  determinant(scaled, g, j);
  inner(g, g, minors);
  largest_root<N>(j, 9.0 - 4.0 * minors, x);
  eigenvector(scaled, x, q);
  refine(scaled, q, r);
}
template <std::size_t N>
PALPATE_INLINE void polar_rotations(const Mat<N>& f, Mat<N>& r) {
  Quaternion<N> q;
  polar_rotations(f, q, r);
}

}  // namespace palpate
