#include "common/wire/shape_blocks.hpp"

#include <algorithm>
#include <bit>

namespace palpate {
namespace {

void append_little(std::uint32_t value, int bytes, std::vector<std::uint8_t>& out) {
  for (int k = 0; k < bytes; ++k) out.push_back(static_cast<std::uint8_t>(value >> 8 * k & 0xff));
}

std::uint32_t read_24(const std::uint8_t* at) { return at[0] | std::uint32_t{at[1]} << 8 | std::uint32_t{at[2]} << 16; }
std::int32_t read_signed_24(const std::uint8_t* at) { return static_cast<std::int32_t>(read_24(at) << 8) >> 8; }

std::size_t packed_bytes(std::size_t count, int bits) { return (count * static_cast<std::size_t>(bits) + 7) / 8; }

/// Appends numbers k, k + stride, ... of `numbers` minus `low`, `bits` each.
void append_packed(std::span<const std::int32_t> numbers, std::size_t k, std::size_t stride, std::int32_t low, int bits,
                   std::vector<std::uint8_t>& out) {
  std::uint64_t held = 0;
  int count = 0;
  for (; k < numbers.size(); k += stride) {
    held |= static_cast<std::uint64_t>(numbers[k] - low) << count;
    for (count += bits; count >= 8; count -= 8, held >>= 8) out.push_back(static_cast<std::uint8_t>(held & 0xff));
  }
  if (count > 0) out.push_back(static_cast<std::uint8_t>(held & 0xff));
}

/// The reverse; returns false when a number is out of range.
bool read_packed(const std::uint8_t* at, std::size_t k, std::size_t stride, std::size_t end, std::int32_t low, int bits,
                 std::array<std::int32_t, 3 * kBlockVertices>& numbers) {
  const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
  std::uint64_t held = 0;
  int count = 0;
  for (; k < end; k += stride) {
    for (; count < bits; count += 8) held |= static_cast<std::uint64_t>(*at++) << count;
    const std::int64_t number = low + static_cast<std::int64_t>(held & mask);
    if (number > kMaxBlockNumber || number < -kMaxBlockNumber) return false;
    numbers[k] = static_cast<std::int32_t>(number);
    held >>= bits;
    count -= bits;
  }
  return true;
}

}  // namespace

void append_block(std::uint32_t index, std::span<const std::int32_t> numbers, int components, std::vector<std::uint8_t>& out) {
  const auto stride = static_cast<std::size_t>(components);
  std::array<std::int32_t, 3> low{}, high{};
  std::copy_n(numbers.begin(), components, low.begin());
  high = low;
  for (std::size_t i = 0; i < numbers.size(); i += stride)
    for (std::size_t k = 0; k < stride; ++k) {
      low[k] = std::min(low[k], numbers[i + k]);
      high[k] = std::max(high[k], numbers[i + k]);
    }
  append_little(index, 3, out);
  append_little(static_cast<std::uint32_t>(numbers.size() / stride), 1, out);
  const auto bits = [&](std::size_t k) { return static_cast<int>(std::bit_width(static_cast<std::uint32_t>(high[k] - low[k]))); };
  for (std::size_t k = 0; k < stride; ++k) append_little(static_cast<std::uint32_t>(bits(k)), 1, out);
  for (std::size_t k = 0; k < stride; ++k) append_little(static_cast<std::uint32_t>(low[k]), 3, out);
  for (std::size_t k = 0; k < stride; ++k) append_packed(numbers, k, stride, low[k], bits(k), out);
}

bool BlockReader::next(ShapeBlock& block) {
  if (rest_.empty() || !ok_) return false;
  ok_ = false;
  const auto n = static_cast<std::size_t>(components_);
  const std::size_t head = 4 + 4 * n;
  if (rest_.size() < head) return false;
  block.index = read_24(rest_.data());
  block.vertices = rest_[3];
  if (block.vertices == 0 || block.vertices > kBlockVertices) return false;
  const std::uint8_t* const bits = &rest_[4];
  std::size_t size = head;
  for (std::size_t k = 0; k < n; ++k) {
    if (bits[k] > kMaxBlockBits) return false;
    size += packed_bytes(block.vertices, bits[k]);
  }
  if (size > rest_.size()) return false;
  const std::uint8_t* at = rest_.data() + head;
  for (std::size_t k = 0; k < n; ++k) {
    const std::int32_t low = read_signed_24(&rest_[4 + n + 3 * k]);
    if (!read_packed(at, k, n, n * block.vertices, low, bits[k], block.numbers)) return false;
    at += packed_bytes(block.vertices, bits[k]);
  }
  rest_ = rest_.subspan(size);
  ok_ = true;
  return true;
}

}  // namespace palpate
