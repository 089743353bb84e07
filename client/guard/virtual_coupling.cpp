#include "client/guard/virtual_coupling.hpp"

#include <algorithm>

namespace palpate {

double passive_stiffness_n_m(double device_damping_n_s_m, double coupling_damping_n_s_m, double period_s) noexcept {
  return std::max(0.0, 2 * (device_damping_n_s_m - coupling_damping_n_s_m) / period_s);
}

Vec3 couple(const CouplingParameters& c, VirtualTool& tool, const Vec3& device, const EnvironmentForce& environment,
            double dt_s) noexcept {
  const Vec3 device_velocity = (device - tool.device) / dt_s;
  const Vec3 pull = c.stiffness_n_m * (device - tool.position) + c.damping_n_s_m * device_velocity + environment.force;
  const double inertia = c.tool_mass_kg + dt_s * c.damping_n_s_m + dt_s * dt_s * (c.stiffness_n_m + environment.stiffness_n_m);
  tool.velocity = (c.tool_mass_kg * tool.velocity + dt_s * pull) / inertia;
  tool.position += dt_s * tool.velocity;
  tool.device = device;
  return -c.stiffness_n_m * (device - tool.position) - c.damping_n_s_m * (device_velocity - tool.velocity);
}

}  // namespace palpate
