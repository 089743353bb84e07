// Lattices of springs of young_pa in bending: as far from the continuum as their cells are coarse, and no further.
#include <catch2/catch.hpp>
#include <string>

#include "server/body/settle.hpp"

using namespace palpate;

namespace {

/// How far the free end of a bar of 100 x 30 x 20 mm, 400 kPa and 1000 kg/m^3, clamped at x = 0, comes down in gravity [mm].
double sag_mm(const std::string& nodes, const std::string& made_of) {
  const Scene scene = read_scene(R"({"body": {"lattice": {"nodes": )" + nodes + R"(, "size_m": [0.1, 0.03, 0.02],
      "fixed_faces": ["x-"], "gravity_m_s2": [0, 0, -9.81], )" +
                                     made_of + "}}}",
                                 "bar.json");
  const Dynamics dynamics(scene.body);
  const Equilibrium hangs = find_equilibrium(dynamics);
  REQUIRE(hangs.found);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if ((scene.body.nodes[i] - Vec3(0.1, 0.015, 0.02)).norm() < 1e-9)
      return 1e3 * (scene.body.nodes[i].z() - node_of(hangs.state.x, i).z());
  FAIL("no node there");
  return 0;
}

}  // namespace

TEST_CASE(
    "A hanging bar of springs of young_pa is within 5 % of finite elements at Cauchy's ratio with eight cells of its height") {
  const double elements = sag_mm("[21, 7, 5]", R"("solid": {"element": "hexahedron", "young_pa": 400000, "poisson": 0.25})");
  const double four = sag_mm("[21, 7, 5]", R"("young_pa": 400000)"), eight = sag_mm("[41, 13, 9]", R"("young_pa": 400000)");
  CAPTURE(elements, four, eight);
  CHECK(eight == Approx(elements).epsilon(0.05));
  CHECK(std::abs(eight - elements) < std::abs(four - elements));
  // Flat cells: 2.5 x 3.75 x 3.33 mm.
  CHECK(sag_mm("[41, 9, 7]", R"("young_pa": 400000)") == Approx(elements).epsilon(0.05));
}
