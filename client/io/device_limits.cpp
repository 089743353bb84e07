#include "client/io/device_limits.hpp"

#include <cmath>
#include <utility>

#include "common/base/error.hpp"

namespace palpate {

GuardLimits limits_of(const DeviceCaps& caps, PassivityMode passivity) {
  const std::pair<double, const char*> limits[] = {{caps.force_max_n, "peak force (force_max_n)"},
                                                   {caps.force_continuous_n, "continuous force (force_continuous_n)"},
                                                   {caps.slew_max_n_s, "slew (slew_max_n_s)"},
                                                   {caps.stiffness_max_n_m, "stiffness (stiffness_max_n_m)"},
                                                   {caps.velocity_max_m_s, "speed (velocity_max_m_s)"}};
  const std::string where = "device " + caps.name;
  if (caps.renders_force) {
    for (const auto& [value, name] : limits)
      if (!(value > 0) || !std::isfinite(value))
        throw InputError(where, std::string("has no limit of its ") + name,
                         "a number above 0: no force is rendered without limits");
    if (caps.workspace.isEmpty() || !caps.workspace.sizes().allFinite())
      throw InputError(where, "has no workspace (workspace)",
                       "a box that its tool point stays in: no force is rendered without limits");
  }
  return {caps.force_max_n, caps.slew_max_n_s, passivity, caps.force_continuous_n, caps.velocity_max_m_s, caps.stiffness_max_n_m};
}

}  // namespace palpate
