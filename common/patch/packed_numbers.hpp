// Numbers in terms (terms_pieces.hpp) as words of 16 bits: halves in a unit that suits the largest of them, or pairs of bytes.
//
//     half     IEEE 754 binary16: sign, 5 bits of exponent, 10 of mantissa; right to 2^-11 = 5e-4 of itself from 6e-5 on
//     unit     2^k, the least with |v| <= kScaledMax 2^k for all numbers v of a list, 1 where all are 0:  word = half(v / 2^k)
//     bytes    b_0, b_1, ...: word = b_0 + 256 b_1, ...; of an odd number the last upper half is 0
//
// A unit is a power of two, so that scaling rounds nothing. What can go wrong: numbers below 2^-27 of the largest lose bits; a
// word from the wire may encode no finite number, which finite_half() detects.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate::packed {

constexpr float kScaledMax = 8192;  // of numbers in their unit: below the end of halves, 65504; all 11 bits down to 2^-27 of it

constexpr int words_of_bytes(int count) { return (count + 1) / 2; }

inline std::uint16_t to_half(float v) { return Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(v)); }
inline float from_half(std::uint16_t v) { return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(v)); }
inline bool finite_half(std::uint16_t v) { return (v & 0x7c00U) != 0x7c00U; }

/// Returns the least power of two that is at least `most`, no less than about 1e-20: a unit for lengths and motions.
float power_of_two_above(float most);

template <class Values>
float unit_of(const Values& values) {
  const float largest = values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0;
  return largest > 0 ? std::exp2(std::ceil(std::log2(largest / kScaledMax))) : 1;  // decoded numbers encode to the same words
}

/// Appends numbers in a unit that suits their largest.
template <class Values>
float append(const Values& values, std::vector<std::uint16_t>& out) {
  const float unit = unit_of(values);
  for (Eigen::Index i = 0; i < values.size(); ++i) out.push_back(to_half(values[i] / unit));
  return unit;
}

/// Takes the next numbers, in their unit.
Eigen::VectorXf take(const std::vector<std::uint16_t>& numbers, int& at, int count, float unit);

/// Appends bytes, two in a word, the first in the lower half.
void append_bytes(std::span<const std::uint8_t> bytes, std::vector<std::uint16_t>& out);

std::vector<std::uint8_t> take_bytes(const std::vector<std::uint16_t>& numbers, int& at, int count);

}  // namespace palpate::packed
