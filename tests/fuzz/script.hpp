// What a fuzzer's bytes are taken for: numbers and stretches of bytes one after the other, until there are none.
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
  /// As many as are asked for, or as are left.
  std::span<const std::uint8_t> bytes(std::size_t size) {
    const auto taken = rest_.first(std::min(size, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  /// Of so many bytes, the lowest first.
  std::uint64_t number(std::size_t size) {
    std::uint64_t value = 0;
    std::size_t shift = 0;
    for (const std::uint8_t byte : bytes(size)) value |= std::uint64_t{byte} << (8 * shift++);
    return value;
  }
  std::string_view text() const { return {reinterpret_cast<const char*>(rest_.data()), rest_.size()}; }

  /// Some of the script's bytes over some of these.
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
