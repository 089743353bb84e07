// A bar whose sag is known from other solvers (bench/calculix/README.md).
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "server/body/settle.hpp"

namespace palpate::test {

/// Sag of the middle of the upper edge of its free end under gravity [mm]: 100 x 30 x 20 mm, 1000 kg/m^3, clamped at x = 0, with
/// `nodes` nodes ("[21, 7, 5]") and the material `made_of` (fields of body.lattice).
inline double hanging_bar_sag_mm(const std::string& nodes, const std::string& made_of) {
  const Scene scene = read_scene(R"({"body": {"lattice": {"nodes": )" + nodes + R"(, "size_m": [0.1, 0.03, 0.02],
      "fixed_faces": ["x-"], "gravity_m_s2": [0, 0, -9.81], )" +
                                     made_of + "}}}",
                                 "bar.json");
  const Dynamics dynamics(scene.body);
  const Equilibrium hangs = find_equilibrium(dynamics);
  REQUIRE(hangs.found);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if ((scene.body.nodes[i] - Vec3(0.1, 0.015, 0.02)).norm() < 1e-9)
      return 1e3 * (scene.body.nodes[i].z() - at_node(hangs.state.x, i).z());
  FAIL("no node there");
  return 0;
}

}  // namespace palpate::test
