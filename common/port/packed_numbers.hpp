// Numbers as they travel in terms (terms_pieces.hpp), in words of 16 bits: halves, in a unit that suits the largest of
// them, or two bytes.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate::packed {

constexpr float kLargest = 8192;  // of the numbers in their unit

constexpr int words_of_bytes(int count) { return (count + 1) / 2; }

inline std::uint16_t to_half(float v) { return Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(v)); }
inline float from_half(std::uint16_t v) { return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(v)); }
inline bool finite_half(std::uint16_t v) { return (v & 0x7c00U) != 0x7c00U; }

template <class Values>
float unit_of(const Values& values) {
  const float largest = values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0;
  return largest > 0 ? std::exp2(std::ceil(std::log2(largest / kLargest))) : 1;  // what arrived goes on as it came
}

/// Appends numbers in a unit that suits their largest.
template <class Values>
float append(const Values& values, std::vector<std::uint16_t>& out) {
  const float unit = unit_of(values);
  for (Eigen::Index i = 0; i < values.size(); ++i) out.push_back(to_half(values[i] / unit));
  return unit;
}

/// The next numbers, in their unit.
Eigen::VectorXf take(const std::vector<std::uint16_t>& numbers, int& at, int count, float unit);

/// Two in a word, the first in the lower half.
void append_bytes(std::span<const std::uint8_t> bytes, std::vector<std::uint16_t>& out);

std::vector<std::uint8_t> take_bytes(const std::vector<std::uint16_t>& numbers, int& at, int count);

}  // namespace palpate::packed
