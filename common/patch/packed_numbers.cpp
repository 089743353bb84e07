#include "common/patch/packed_numbers.hpp"

#include <algorithm>
#include <cassert>

namespace palpate::packed {

float power_of_two_above(float most) { return std::exp2(std::ceil(std::log2(std::max(most, 1e-20F)))); }

Eigen::VectorXf take(const std::vector<std::uint16_t>& numbers, int& at, int count, float unit) {
  assert(at >= 0 && static_cast<std::size_t>(at + count) <= numbers.size());
  Eigen::VectorXf values(count);
  for (int i = 0; i < count; ++i) values[i] = unit * from_half(numbers[static_cast<std::size_t>(at++)]);
  return values;
}

void append_bytes(std::span<const std::uint8_t> bytes, std::vector<std::uint16_t>& out) {
  for (std::size_t k = 0; k < bytes.size(); k += 2)
    out.push_back(static_cast<std::uint16_t>(bytes[k] | (k + 1 < bytes.size() ? bytes[k + 1] : 0U) << 8U));
}

std::vector<std::uint8_t> take_bytes(const std::vector<std::uint16_t>& numbers, int& at, int count) {
  assert(at >= 0 && static_cast<std::size_t>(at + words_of_bytes(count)) <= numbers.size());
  std::vector<std::uint8_t> bytes;
  for (int k = 0; k < count; ++k)
    bytes.push_back(static_cast<std::uint8_t>(numbers[static_cast<std::size_t>(at + k / 2)] >> (k % 2 == 0 ? 0U : 8U)));
  at += words_of_bytes(count);
  return bytes;
}

}  // namespace palpate::packed
