// 3x3 matrices, one in every lane of a vector (doubles.hpp), with the same bits for every width N.
//
//     cofactors     G_ij = F_(i+1)(j+1) F_(i+2)(j+2) - F_(i+2)(j+1) F_(i+1)(j+2),  indices modulo 3:  G = dJ/dF
//     determinant   J = sum_i F_i1 G_i1
//     inner         A : B = sum_ij A_ij B_ij
//
// `of[i][j]` has entry ij of all lanes.
#pragma once

#include "common/base/doubles.hpp"

namespace palpate {

template <std::size_t N>
struct Mat {
  using Lanes = Doubles<N>;
  Lanes of[3][3];
};

template <std::size_t N>
PALPATE_INLINE void cofactors(const Mat<N>& f, Mat<N>& g) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int s = (r + 1) % 3, t = (r + 2) % 3, p = (c + 1) % 3, q = (c + 2) % 3;
      g.of[r][c] = f.of[s][p] * f.of[t][q] - f.of[t][p] * f.of[s][q];
    }
}

/// Computes det F from the cofactors G of F.
template <std::size_t N>
PALPATE_INLINE void determinant(const Mat<N>& f, const Mat<N>& g, Doubles<N>& j) {
  j = f.of[0][0] * g.of[0][0] + f.of[1][0] * g.of[1][0] + f.of[2][0] * g.of[2][0];
}

/// Computes the sum of the products of their entries.
template <std::size_t N>
PALPATE_INLINE void inner(const Mat<N>& a, const Mat<N>& b, Doubles<N>& sum) {
  sum = a.of[0][0] * b.of[0][0];
  for (int k = 1; k < 9; ++k) sum += a.of[k / 3][k % 3] * b.of[k / 3][k % 3];
}

}  // namespace palpate
