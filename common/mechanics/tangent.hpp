// The derivative of a stress by the deformation gradient, A = dP/dF, symmetric as the second derivative of an energy: in every
// lane 9 x 9 numbers in the order of F's entries row by row, of which the upper half is stored. It is put together from parts:
//
//     add_identity   a dF                      add_outer       c (Q : dF) Q
//     add_right      dF M,  M = M^T            add_left        B dF,  B = B^T
//     add_cross      c F dF^T F                add_cofactors   kappa X(F)[dF], the change of the cofactors of F with dF
//
// and used as apply(), A dF, and block(), the stiffness between two nodes: with b_i the gradient of node i's shape function, a
// motion u_j of node j changes F by u_j b_j^T, and the force on node i changes by -V K_ij u_j, K_ij[r][s] = b_i[c] A_rc,sd
// b_j[d].
#pragma once

#include "common/mechanics/lanes.hpp"

namespace palpate {

/// Index of the entry for dP_(i / 3)(i % 3) / dF_(k / 3)(k % 3), i <= k.
constexpr int tangent_index(int i, int k) { return i * (17 - i) / 2 + k; }

template <typename L>
struct Tangent {
  static constexpr int kEntries = 45;
  L of[kEntries];

  PALPATE_INLINE const L& at(int i, int k) const { return of[i <= k ? tangent_index(i, k) : tangent_index(k, i)]; }
  PALPATE_INLINE L& at(int i, int k) { return of[i <= k ? tangent_index(i, k) : tangent_index(k, i)]; }
  PALPATE_INLINE void clear() {
    for (L& entry : of) entry = L{};
  }
  PALPATE_INLINE void add_identity(const L& a) {
    for (int i = 0; i < 9; ++i) at(i, i) += a;
  }
  PALPATE_INLINE void add_outer(const L& c, const LaneMatrix<L>& q) {
    for (int i = 0; i < 9; ++i) {
      const L row = c * q.of[i / 3][i % 3];
      for (int k = i; k < 9; ++k) at(i, k) += row * q.of[k / 3][k % 3];
    }
  }
  PALPATE_INLINE void add_right(const LaneMatrix<L>& m) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        for (int d = c; d < 3; ++d) at(3 * r + c, 3 * r + d) += m.of[c][d];
  }
  PALPATE_INLINE void add_left(const LaneMatrix<L>& b) {
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        for (int s = r; s < 3; ++s) at(3 * r + c, 3 * s + c) += b.of[r][s];
  }
  PALPATE_INLINE void add_cross(const L& much, const LaneMatrix<L>& f) {
    for (int i = 0; i < 9; ++i)
      for (int k = i; k < 9; ++k) at(i, k) += much * (f.of[i / 3][k % 3] * f.of[k / 3][i % 3]);
  }
  PALPATE_INLINE void add_cofactors(const L& kappa, const LaneMatrix<L>& f) {
    LaneMatrix<L> g;
    for (int k = 0; k < 9; ++k) g.of[k / 3][k % 3] = kappa * f.of[k / 3][k % 3];
    // Every pair of entries in different rows r, s and columns c, d of F has one cofactor in common.
    for (int r = 0; r < 3; ++r)
      for (int s = r + 1; s < 3; ++s)
        for (int c = 0; c < 3; ++c)
          for (int d = 0; d < 3; ++d) {
            if (c == d) continue;
            const bool even = (s - r == 1) == ((d - c + 3) % 3 == 1);
            const L& entry = g.of[3 - r - s][3 - c - d];
            if (even)
              at(3 * r + c, 3 * s + d) += entry;
            else
              at(3 * r + c, 3 * s + d) -= entry;
          }
  }

  /// Computes dP = A dF.
  PALPATE_INLINE void apply(const LaneMatrix<L>& df, LaneMatrix<L>& dp) const {
    for (int i = 0; i < 9; ++i) {
      L sum = at(i, 0) * df.of[0][0];
      for (int k = 1; k < 9; ++k) sum += at(i, k) * df.of[k / 3][k % 3];
      dp.of[i / 3][i % 3] = sum;
    }
  }
};

/// A b_j, from which the blocks of node j with all others follow: of[i][s], i an entry of P, s a component of u_j.
template <typename L>
struct TangentColumns {
  L of[9][3];
};
template <typename L>
PALPATE_INLINE void columns_of(const Tangent<L>& a, const L (&b)[3], TangentColumns<L>& columns) {
  for (int i = 0; i < 9; ++i)
    for (int s = 0; s < 3; ++s) columns.of[i][s] = a.at(i, 3 * s) * b[0] + a.at(i, 3 * s + 1) * b[1] + a.at(i, 3 * s + 2) * b[2];
}
/// Computes K_ij from the columns of node j.
template <typename L>
PALPATE_INLINE void block(const TangentColumns<L>& of_j, const L (&b_i)[3], LaneMatrix<L>& k) {
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s)
      k.of[r][s] = b_i[0] * of_j.of[3 * r][s] + b_i[1] * of_j.of[3 * r + 1][s] + b_i[2] * of_j.of[3 * r + 2][s];
}

}  // namespace palpate
