// Words of a file or a sender inside a message for people: on one line, short, and without what a terminal would obey.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "common/base/plain_text.hpp"

namespace palpate {

/// The text with '?' for every control character and every byte that is not UTF-8.
inline std::string made_plain(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::string_view character = text.substr(0, std::max<std::size_t>(1, character_bytes(text)));
    out += is_plain_text(character) ? std::string(character) : "?";
    text.remove_prefix(character.size());
  }
  return out;
}

/// "text", made plain, in double quotes or in those given; what exceeds 60 bytes as "...".
inline std::string in_quotes(std::string_view text, char mark = '"') {
  constexpr std::size_t kShown = 60;
  const std::string plain = made_plain(text.substr(0, kShown + 1));
  const std::string_view shown = cut_text(plain, kShown);
  return mark + std::string(shown) + (shown.size() < plain.size() ? "..." : "") + mark;
}

}  // namespace palpate
