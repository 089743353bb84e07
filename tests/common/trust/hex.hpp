#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace palpate::test {

inline std::vector<std::uint8_t> from_hex(std::string_view text) {
  const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  std::vector<std::uint8_t> bytes;
  for (std::size_t k = 0; k + 1 < text.size(); k += 2)
    bytes.push_back(static_cast<std::uint8_t>(digit(text[k]) << 4 | digit(text[k + 1])));
  return bytes;
}

}  // namespace palpate::test
