#include "common/port/scheme.hpp"

namespace palpate {

std::optional<Scheme> scheme_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kSchemeNames.size(); ++i)
    if (kSchemeNames[i] == name) return static_cast<Scheme>(i);
  return std::nullopt;
}

bool is_available(Scheme scheme) {
  switch (scheme) {
    case Scheme::hold:
    case Scheme::filtered:
    case Scheme::tangent:
    case Scheme::ring:
    case Scheme::two_layer:
    case Scheme::balanced:
    case Scheme::port:
    case Scheme::hyper:
      return true;
  }
  return false;
}

}  // namespace palpate
