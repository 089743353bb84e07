// Text from a file or a sender, made safe for messages: on one line, short, and without control characters for terminals.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "common/base/plain_text.hpp"

namespace palpate {

/// Returns the text with '?' for every control character and every byte that is not UTF-8.
inline std::string made_plain(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::string_view character = text.substr(0, std::max<std::size_t>(1, character_bytes(text)));
    out += is_plain_text(character) ? std::string(character) : "?";
    text.remove_prefix(character.size());
  }
  return out;
}

/// Returns the text, made plain, in double quotes or the given mark; the part beyond 60 bytes becomes "...".
inline std::string in_quotes(std::string_view text, char mark = '"') {
  constexpr std::size_t kShown = 60;
  const std::string plain = made_plain(text.substr(0, kShown + 1));
  const std::string_view shown = cut_text(plain, kShown);
  return mark + std::string(shown) + (shown.size() < plain.size() ? "..." : "") + mark;
}

}  // namespace palpate
