// Vectors of numbers ("lanes"), and 3x3 matrices with one matrix in every lane.
//
//     cofactors     G_ij = F_(i+1)(j+1) F_(i+2)(j+2) - F_(i+2)(j+1) F_(i+1)(j+2),  indices modulo 3:  G = dJ/dF
//     determinant   J = sum_i F_i0 G_i0
//     inner         A : B = sum_ij A_ij B_ij
//     ln x = e ln 2 + 2 (f + f^3/3 + ... + f^21/21),  x = 2^e m, f = (m - 1) / (m + 1), 1/sqrt 2 < m <= sqrt 2
//     exp y = 2^k exp r,  k next to y / ln 2, |r| <= ln 2 / 2, exp r by its series to r^13 / 13!
//
// L is a vector type of the compiler: two, four or eight doubles, or eight floats. Every lane is computed by the
// same operations in the same order and nothing is contracted, so a lane's bits depend neither on the width nor on its
// neighbours. A vector is never passed or returned by value, as the calling convention depends on the target processor. ln and
// exp are for doubles, with a relative error of about 4e-16; ln 2 is a sum of two numbers, of which the first has so few digits
// that its products with e and k are exact.
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#include "common/base/doubles.hpp"

namespace palpate {

template <typename Number, std::size_t N>
struct LanesOf;
template <>
struct LanesOf<double, 2> {
  using Type = double __attribute__((vector_size(16)));
};
template <>
struct LanesOf<double, 4> {
  using Type = double __attribute__((vector_size(32)));
};
template <>
struct LanesOf<double, 8> {
  using Type = double __attribute__((vector_size(64)));
};
template <>
struct LanesOf<float, 8> {
  using Type = float __attribute__((vector_size(32)));
};
/// A vector of N numbers.
template <typename Number, std::size_t N>
using Lanes = typename LanesOf<Number, N>::Type;

/// The number in a lane of L.
template <typename L>
using LaneNumber = std::remove_cvref_t<decltype(L{}[0])>;
template <typename L>
inline constexpr std::size_t kLanes = sizeof(L) / sizeof(LaneNumber<L>);
/// Result of a comparison: in every lane all bits or none.
template <typename L>
using LaneTruths = decltype(L{} < L{});

template <typename L>
struct LaneMatrix {
  L of[3][3];
};

/// Copies the lanes from and to consecutive numbers.
template <typename L>
PALPATE_INLINE void load_lanes(const LaneNumber<L>* from, L& to) {
  // not by memcpy, which GCC 12 does in two halves, for which the next load of the whole has to wait
  using Unaligned [[gnu::may_alias, gnu::aligned(alignof(LaneNumber<L>))]] = L;
  to = *reinterpret_cast<const Unaligned*>(from);
}
template <typename L>
PALPATE_INLINE void store_lanes(const L& from, LaneNumber<L>* to) {
  __builtin_memcpy(to, &from, sizeof(L));
}

template <typename L>
PALPATE_INLINE bool any_lane(const LaneTruths<L>& truths) {
  bool any = false;
  for (std::size_t l = 0; l < kLanes<L>; ++l) any |= truths[l] != 0;
  return any;
}

/// Computes square roots.
template <typename L>
PALPATE_INLINE void lane_roots(const L& of, L& root) {
  for (std::size_t l = 0; l < kLanes<L>; ++l) root[l] = std::sqrt(of[l]);
}

inline constexpr double kLnTwoHigh = 0x1.62e42feep-1;       ///< ln 2 to 32 bits: exact when multiplied by an integer below 2^21
inline constexpr double kLnTwoLow = 0x1.a39ef35793c76p-33;  ///< ln 2 minus that

/// Computes y = ln x for x from 1e-300 to 1e300.
template <typename L>
PALPATE_INLINE void lane_logs(const L& x, L& y) {
  using Bits = LaneTruths<L>;
  constexpr long long kMantissaBits = 0x000f'ffff'ffff'ffff, kOneBits = 0x3ff0'0000'0000'0000;  // IEEE 754: 52 bits; those of 1.0
  const Bits bits = __builtin_bit_cast(Bits, x), mantissa = (bits & kMantissaBits) | kOneBits;
  L m = __builtin_bit_cast(L, mantissa);
  const Bits above = m > 1.4142135623730951;  // -1 where true
  m = above ? 0.5 * m : m;
  const Bits power = (bits >> 52) - 1023 - above;
  const L e = __builtin_convertvector(power, L);
  const L f = (m - 1.0) / (m + 1.0), s = f * f;
  L series = s * (1.0 / 21) + 1.0 / 19;
  for (int k = 17; k >= 1; k -= 2) series = series * s + 1.0 / k;
  y = e * kLnTwoHigh + (2.0 * f * series + e * kLnTwoLow);
}

/// Computes x = exp y for y from -700 to 700.
template <typename L>
PALPATE_INLINE void lane_exps(const L& y, L& x) {
  using Bits = LaneTruths<L>;
  constexpr double kRounder = 0x1.8p52;  // 3/2 2^52: adding it rounds to an integer in the last bits
  const L rounded = y * 1.4426950408889634 + kRounder, k = rounded - kRounder;
  const L r = (y - k * kLnTwoHigh) - k * kLnTwoLow;
  L series = r * (1.0 / 13) + 1.0;
  for (int n = 12; n >= 1; --n) series = series * r * (1.0 / n) + 1.0;
  const Bits bits = __builtin_bit_cast(Bits, series) + (__builtin_bit_cast(Bits, rounded) << 52);
  x = __builtin_bit_cast(L, bits);
}

template <typename L>
PALPATE_INLINE void cofactors(const LaneMatrix<L>& f, LaneMatrix<L>& g) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int s = (r + 1) % 3, t = (r + 2) % 3, p = (c + 1) % 3, q = (c + 2) % 3;
      g.of[r][c] = f.of[s][p] * f.of[t][q] - f.of[t][p] * f.of[s][q];
    }
}

/// Computes det F from the cofactors G of F.
template <typename L>
PALPATE_INLINE void determinant(const LaneMatrix<L>& f, const LaneMatrix<L>& g, L& j) {
  j = f.of[0][0] * g.of[0][0] + f.of[1][0] * g.of[1][0] + f.of[2][0] * g.of[2][0];
}

template <typename L>
PALPATE_INLINE void inner(const LaneMatrix<L>& a, const LaneMatrix<L>& b, L& sum) {
  sum = a.of[0][0] * b.of[0][0];
  for (int k = 1; k < 9; ++k) sum += a.of[k / 3][k % 3] * b.of[k / 3][k % 3];
}

/// Computes C = A^T B.
template <typename L>
PALPATE_INLINE void transposed_product(const LaneMatrix<L>& a, const LaneMatrix<L>& b, LaneMatrix<L>& c) {
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) c.of[r][s] = a.of[0][r] * b.of[0][s] + a.of[1][r] * b.of[1][s] + a.of[2][r] * b.of[2][s];
}

/// Computes C = A B^T.
template <typename L>
PALPATE_INLINE void product_with_transposed(const LaneMatrix<L>& a, const LaneMatrix<L>& b, LaneMatrix<L>& c) {
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) c.of[r][s] = a.of[r][0] * b.of[s][0] + a.of[r][1] * b.of[s][1] + a.of[r][2] * b.of[s][2];
}

/// Computes F = 1 + H.
template <typename L>
PALPATE_INLINE void deformation_gradient(const LaneMatrix<L>& h, LaneMatrix<L>& f) {
  f = h;
  for (int r = 0; r < 3; ++r) f.of[r][r] += LaneNumber<L>(1);
}

}  // namespace palpate
