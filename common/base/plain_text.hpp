// Text from elsewhere: UTF-8 (RFC 3629) on one line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace palpate {

/// Bytes of the character that `s` begins with, 0 where it begins with none: not UTF-8 in its shortest form, a surrogate, or
/// beyond U+10FFFF.
constexpr std::size_t character_bytes(std::string_view s) {
  const auto byte = [&](std::size_t k) { return static_cast<std::uint32_t>(static_cast<unsigned char>(s[k])); };
  if (s.empty()) return 0;
  const std::uint32_t lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || s.size() < length) return 0;
  std::uint32_t code = lead & (0xffu >> (length + 1));
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(k) & 0x3f);
  }
  const bool shortest = length == 2 || (length == 3 ? code >= 0x800 : code >= 0x10000 && code <= 0x10ffff);
  return shortest && !(code >= 0xd800 && code <= 0xdfff) ? length : 0;
}

/// Whether all of it is UTF-8 without control characters (C0, DEL, C1).
constexpr bool is_plain_text(std::string_view s) {
  while (!s.empty()) {
    const std::size_t length = character_bytes(s);
    const auto first = static_cast<unsigned char>(s[0]);
    const bool control =
        first < 0x20 || first == 0x7f || (first == 0xc2 && length == 2 && static_cast<unsigned char>(s[1]) < 0xa0);
    if (length == 0 || control) return false;
    s.remove_prefix(length);
  }
  return true;
}

/// The longest beginning of at most `most` bytes that does not end within a character.
constexpr std::string_view cut_text(std::string_view s, std::size_t most) {
  std::size_t end = 0;
  while (end < s.size()) {
    const std::size_t length = character_bytes(s.substr(end));
    if (length == 0 || end + length > most) break;
    end += length;
  }
  return s.substr(0, end);
}

}  // namespace palpate
