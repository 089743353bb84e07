// Interprets a fuzzer's bytes as numbers and byte strings, one after the other, until none are left.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace palpate::test {

class Script {
 public:
  Script(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}

  bool ended() const { return rest_.empty(); }
  /// Returns as many bytes as requested, or the remaining ones.
  std::span<const std::uint8_t> bytes(std::size_t size) {
    const auto taken = rest_.first(std::min(size, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  /// Returns a number of `size` bytes, lowest first.
  std::uint64_t number(std::size_t size) {
    std::uint64_t value = 0;
    std::size_t shift = 0;
    for (const std::uint8_t byte : bytes(size)) value |= std::uint64_t{byte} << (8 * shift++);
    return value;
  }
  std::string_view text() const { return {reinterpret_cast<const char*>(rest_.data()), rest_.size()}; }

  /// Overwrites some of the datagram's bytes with bytes of the script.
  template <class Byte>
  void damage(std::span<Byte> datagram) {
    const std::size_t at = number(2);
    for (const std::uint8_t byte : bytes(1 + number(1) % 8))
      if (!datagram.empty()) datagram[at % datagram.size()] ^= static_cast<Byte>(byte);
  }

 private:
  std::span<const std::uint8_t> rest_;
};

}  // namespace palpate::test
