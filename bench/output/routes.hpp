// Measured network routes by name, so that an experiment can run over a real route.
//
// Round trips of a teleoperation service over the public internet, from San Francisco (its maintainers' figures: dimos, hosted
// teleoperation over WebRTC, github.com/dimensionalOS/dimos, pull request 2982). Jitter and loss were not stated there.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "common/base/error.hpp"

namespace palpate {

struct Route {
  std::string_view name;
  double rtt_ms = 0;
};

inline constexpr std::array<Route, 4> kRoutes{
    {{"san-francisco", 15}, {"bangalore", 114}, {"buenos-aires", 134}, {"shanghai", 160}}};

/// Throws InputError, with the known names, for an unknown route.
inline const Route& route_from_name(std::string_view name) {
  std::string names;
  for (const Route& route : kRoutes) {
    if (route.name == name) return route;
    names += (names.empty() ? "" : ", ") + std::string(route.name);
  }
  throw InputError("--route " + std::string(name), "is no route that is known", "one of " + names);
}

}  // namespace palpate
