// Numbers of things in texts for people.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace palpate {

/// Returns for example "1 frame" or "2 frames". `what`: the singular, of a word whose plural ends in s.
inline std::string counted(std::uint64_t n, std::string_view what) {
  return std::to_string(n) + " " + std::string(what) + (n == 1 ? "" : "s");
}

}  // namespace palpate
