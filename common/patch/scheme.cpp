#include "common/patch/scheme.hpp"

namespace palpate {

std::optional<Scheme> scheme_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kSchemeNames.size(); ++i)
    if (kSchemeNames[i] == name) return static_cast<Scheme>(i);
  return std::nullopt;
}

}  // namespace palpate
