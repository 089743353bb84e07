#include "client/io/device_limits.hpp"

#include <cmath>
#include <initializer_list>
#include <utility>

#include "common/base/error.hpp"

namespace palpate {

GuardLimits limits_of(const DeviceCaps& caps, PassivityMode passivity) {
  using Limits = std::initializer_list<std::pair<double, const char*>>;
  const std::string where = "device " + caps.name;
  const auto need = [&](const Limits& limits, const char* what) {
    for (const auto& [value, name] : limits)
      if (!(value > 0) || !std::isfinite(value))
        throw InputError(where, std::string("has no limit of its ") + name,
                         std::string("a number above 0: no ") + what + " is rendered without limits");
  };
  if (caps.renders_force) {
    need({{caps.force_max_n, "peak force (force_max_n)"},
          {caps.force_continuous_n, "continuous force (force_continuous_n)"},
          {caps.slew_max_n_s, "slew (slew_max_n_s)"},
          {caps.stiffness_max_n_m, "stiffness (stiffness_max_n_m)"},
          {caps.velocity_max_m_s, "speed (velocity_max_m_s)"}},
         "force");
    if (caps.workspace.isEmpty() || !caps.workspace.sizes().allFinite())
      throw InputError(where, "has no workspace (workspace)",
                       "a box that its tool point stays in: no force is rendered without limits");
  }
  if (caps.renders_torque) {
    need({{caps.torque_max_nm, "peak torque (torque_max_nm)"},
          {caps.torque_continuous_nm, "continuous torque (torque_continuous_nm)"},
          {caps.torque_slew_max_nm_s, "change of torque (torque_slew_max_nm_s)"},
          {caps.spin_max_rad_s, "rate of rotation (spin_max_rad_s)"}},
         "torque");
    if (!caps.has_orientation || !caps.renders_force)
      throw InputError(where, "renders a torque without " + std::string(caps.renders_force ? "orientation" : "force"),
                       "a device that reads orientation and renders force as well");
  }
  return {.force_max_n = caps.force_max_n,
          .slew_max_n_s = caps.slew_max_n_s,
          .passivity = passivity,
          .force_continuous_n = caps.force_continuous_n,
          .velocity_max_m_s = caps.velocity_max_m_s,
          .stiffness_max_n_m = caps.stiffness_max_n_m,
          .renders_torque = caps.renders_torque || !caps.renders_force,
          .torque_max_nm = caps.torque_max_nm,
          .torque_slew_max_nm_s = caps.torque_slew_max_nm_s,
          .torque_continuous_nm = caps.torque_continuous_nm,
          .spin_max_rad_s = caps.spin_max_rad_s,
          .torsion_stiffness_max_nm_rad = caps.torsion_stiffness_max_nm_rad};
}

}  // namespace palpate
