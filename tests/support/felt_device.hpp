// A device that renders a force, has all limits, and stays at one position or trembles about it.
#pragma once

#include <atomic>

#include "client/device/device.hpp"

namespace palpate::test {

inline DeviceCaps felt_caps(const std::string& name = "stand-in") {
  DeviceCaps caps;
  caps.name = name;
  caps.force_max_n = 8.5;
  caps.force_continuous_n = 8.5;
  caps.slew_max_n_s = 2000;
  caps.stiffness_max_n_m = 800;
  caps.velocity_max_m_s = 2;
  caps.workspace = Eigen::AlignedBox3d(Vec3::Constant(-0.1), Vec3::Constant(0.1));
  return caps;
}

}  // namespace palpate::test
