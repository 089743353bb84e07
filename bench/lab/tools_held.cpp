#include "bench/lab/tools_held.hpp"

#include <fmt/format.h>

#include "common/base/error.hpp"
#include "server/scene/tools.hpp"

namespace palpate {

std::vector<std::uint8_t> tools_held(const Scene& scene, const std::vector<std::string>& names, std::size_t hands,
                                     const std::string& counted) {
  if (!names.empty() && names.size() != hands)
    throw InputError("--tools", fmt::format("has {} names", names.size()), fmt::format("{}, as {} says", hands, counted));
  std::vector<std::uint8_t> held;
  for (const std::string& name : names) held.push_back(tool_number(scene, name, "--tools"));
  return held;
}

}  // namespace palpate
