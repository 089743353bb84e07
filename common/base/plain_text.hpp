// Text from outside: UTF-8 (RFC 3629) on one line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace palpate {

/// Returns the size in bytes of the first character of `s`, 0 for invalid bytes: not UTF-8 in its shortest form, a surrogate, or
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

/// Returns the code of a character of that many bytes.
constexpr std::uint32_t code_of(std::string_view s, std::size_t bytes) {
  std::uint32_t code = static_cast<unsigned char>(s[0]);
  if (bytes > 1) code &= 0xffu >> (bytes + 1);
  for (std::size_t k = 1; k < bytes; ++k) code = code << 6 | (static_cast<unsigned char>(s[k]) & 0x3f);
  return code;
}

/// True for control characters (C0, DEL, C1), ends of lines and paragraphs, and those of Unicode's class Cf, which change the
/// direction of the following text or are invisible: a text with them looks like another one.
constexpr bool is_invisible(std::uint32_t code) {
  constexpr std::uint32_t kRanges[][2] = {
      {0x00, 0x1f},       {0x7f, 0x9f},       {0xad, 0xad},      {0x600, 0x605},     {0x61c, 0x61c},     {0x6dd, 0x6dd},
      {0x70f, 0x70f},     {0x890, 0x891},     {0x8e2, 0x8e2},    {0x180e, 0x180e},   {0x200b, 0x200f},   {0x2028, 0x202e},
      {0x2060, 0x206f},   {0xfeff, 0xfeff},   {0xfff9, 0xfffb},  {0x110bd, 0x110bd}, {0x110cd, 0x110cd}, {0x13430, 0x1343f},
      {0x1bca0, 0x1bca3}, {0x1d173, 0x1d17a}, {0xe0000, 0xe007f}};
  for (const auto& [first, last] : kRanges)
    if (code >= first && code <= last) return true;
  return false;
}

/// True when the text is UTF-8 and completely visible.
constexpr bool is_plain_text(std::string_view s) {
  while (!s.empty()) {
    const std::size_t length = character_bytes(s);
    if (length == 0 || is_invisible(code_of(s, length))) return false;
    s.remove_prefix(length);
  }
  return true;
}

inline constexpr char kNameCharacters[] = "UTF-8 without control characters, others that cannot be seen, or \"";
/// True when the text may be the name of a station, room or scene: plain text without the quotes that logs and tables put around
/// it.
constexpr bool is_plain_name(std::string_view s) { return is_plain_text(s) && s.find('"') == std::string_view::npos; }

/// Returns the longest beginning of at most `most` bytes that does not end within a character.
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
