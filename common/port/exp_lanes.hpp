// Logarithm and exponential in every lane of a vector (doubles.hpp), with a relative error of some 4e-16.
//
//     ln x = e ln 2 + 2 (f + f^3/3 + ... + f^21/21),  x = 2^e m, f = (m - 1) / (m + 1), 1/sqrt 2 < m <= sqrt 2
//     exp y = 2^k exp r,  k next to y / ln 2, |r| <= ln 2 / 2, exp r by its series to r^13 / 13!
//
// ln 2 as a sum of two numbers, the first with few enough digits that e ln 2 and k ln 2 are exact in it.
#pragma once

#include "common/base/doubles.hpp"

namespace palpate {

inline constexpr double kPortLnTwoHigh = 0x1.62e42feep-1;  ///< ln 2 to 32 bits: exact when multiplied by an integer below 2^21
inline constexpr double kPortLnTwoLow = 0x1.a39ef35793c76p-33;  ///< ln 2 minus that

/// Computes y = ln x for x from 1e-300 to 1e300.
template <std::size_t N>
PALPATE_INLINE void logs(const Doubles<N>& x, Doubles<N>& y) {
  using Bits = Truths<N>;
  constexpr long long kMantissaBits = 0x000f'ffff'ffff'ffff, kOneBits = 0x3ff0'0000'0000'0000;  // IEEE 754: 52 bits; those of 1.0
  const Bits bits = __builtin_bit_cast(Bits, x), mantissa = (bits & kMantissaBits) | kOneBits;
  Doubles<N> m = __builtin_bit_cast(Doubles<N>, mantissa);
  const Bits above = m > 1.4142135623730951;  // -1 where true
  m = above ? 0.5 * m : m;
  const Bits power = (bits >> 52) - 1023 - above;
  const Doubles<N> e = __builtin_convertvector(power, Doubles<N>);
  const Doubles<N> f = (m - 1.0) / (m + 1.0), s = f * f;
  Doubles<N> series = s * (1.0 / 21) + 1.0 / 19;
  for (int k = 17; k >= 1; k -= 2) series = series * s + 1.0 / k;
  y = e * kPortLnTwoHigh + (2.0 * f * series + e * kPortLnTwoLow);
}

/// Computes x = exp y for y from -700 to 700.
template <std::size_t N>
PALPATE_INLINE void exps(const Doubles<N>& y, Doubles<N>& x) {
  using Bits = Truths<N>;
  constexpr double kRounder = 0x1.8p52;  // 3/2 2^52: adding it rounds to an integer in the last bits
  const Doubles<N> rounded = y * 1.4426950408889634 + kRounder, k = rounded - kRounder;
  const Doubles<N> r = (y - k * kPortLnTwoHigh) - k * kPortLnTwoLow;
  Doubles<N> series = r * (1.0 / 13) + 1.0;
  for (int n = 12; n >= 1; --n) series = series * r * (1.0 / n) + 1.0;
  const Bits bits = __builtin_bit_cast(Bits, series) + (__builtin_bit_cast(Bits, rounded) << 52);
  x = __builtin_bit_cast(Doubles<N>, bits);
}

}  // namespace palpate
