// Virtual coupling: a spring and a damper between the device and a virtual tool. The environment pushes only the virtual tool.
//
//     m_v x_v'' = k_c (x_d - x_v) + b_c (x_d' - x_v') + F_e(x_v)
//     force on the device = -k_c (x_d - x_v) - b_c (x_d' - x_v')
//
// x_d device, x_v virtual tool [m], F_e the environment's force on the tool [N]. However stiff the environment, the device meets
// at most k_c and b_c, so that a device with damping b is passive at the sampling period T when
//     b > k_c T / 2 + b_c
// One tick is backward Euler, implicit in the coupling and in the stiffness K_e that the environment reports (0: F_e is explicit,
// which is stable for soft environments only: K_e T^2 below about m_v + T b_c):
//     v+ = (m_v v + T (k_c (x_d - x_v) + b_c v_d + F_e)) / (m_v + T b_c + T^2 (k_c + K_e)),    x_v+ = x_v + T v+
// with v_d the displacement of the device in the tick, divided by T. m_v may be zero.
// Source: Colgate, Stanley and Brown, IROS 1995; the condition: Colgate and Schenkel, J. Robotic Systems 14 (1997).
#pragma once

#include "common/base/types.hpp"

namespace palpate {

struct CouplingParameters {
  double stiffness_n_m = 0;  ///< k_c > 0
  double damping_n_s_m = 0;  ///< b_c >= 0
  double tool_mass_kg = 0;   ///< m_v >= 0
};

/// The environment at the virtual tool's position.
struct EnvironmentForce {
  Vec3 force = Vec3::Zero();  ///< on the tool [N]
  double stiffness_n_m = 0;   ///< K_e: growth of that force per displacement of the tool against it
};

/// State of the coupling.
struct VirtualTool {
  Vec3 position = Vec3::Zero(), velocity = Vec3::Zero();  ///< x_v, v
  Vec3 device = Vec3::Zero();                             ///< x_d of the last tick
};

/// Returns the largest k_c that keeps a device with damping b passive at the period T, 2 (b - b_c) / T; 0 when even the damper is
/// too strong.
double passive_stiffness_n_m(double device_damping_n_s_m, double coupling_damping_n_s_m, double period_s) noexcept;

/// Runs one tick of `dt_s` > 0: moves the tool and returns the force on the device [N]. Does not allocate or throw.
Vec3 couple(const CouplingParameters& coupling, VirtualTool& tool, const Vec3& device, const EnvironmentForce& environment,
            double dt_s) noexcept;

}  // namespace palpate
