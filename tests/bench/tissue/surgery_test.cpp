// Needles, blades, tears and threads against their laws, on the smallest meshes of palpate-lab surgery.
#include <catch2/catch.hpp>

#include "bench/tissue/tissue_case.hpp"

using namespace palpate;

TEST_CASE("A needle and a blade take the work of their tissue's toughness for what they cut, and bear the force that it gives") {
  const int cells = GENERATE(6, 9);
  for (const char* name : {"needle, puncture", "needle, force less friction", "needle, work per area", "needle, double insertion",
                           "blade, force", "blade, work per area"}) {
    CAPTURE(name, cells);
    const TissueCase& of = tissue_case(name);
    CHECK(of.solve(TissueElement::hexahedron, cells).value == Approx(of.reference).epsilon(0.05));
  }
}

TEST_CASE("Tears take the work of their tissue's toughness, and threads bear what their laws give") {
  const auto [name, cells, tolerance] =
      GENERATE(table<const char*, int, double>({{"double cantilever, energy by two lengths", 2, 1e-3},
                                                {"double cantilever, energy by two lengths", 4, 1e-3},
                                                {"double cantilever, energy by CalculiX", 2, 0.08},
                                                {"double cantilever, energy by CalculiX", 4, 0.03},
                                                {"double cantilever, energy of beams", 2, 0.1},
                                                {"double cantilever, energy of beams", 4, 0.05},
                                                {"double cantilever, work per area, 10 mm/s", 2, 0.05},
                                                {"double cantilever, work per area, 40 mm/s", 2, 0.06},
                                                {"trouser tear, force of a leg", 2, 0.05},
                                                {"trouser tear, work per area", 2, 0.06},
                                                {"thread around a bite, ratio", 2, 0.02},
                                                {"thread around a bite, ratio", 4, 0.02},
                                                {"thread that cuts, force", 2, 0.05},
                                                {"thread that cuts, work per length", 2, 0.05}}));
  CAPTURE(name, cells);
  const TissueCase& of = tissue_case(name);
  CHECK(of.solve(TissueElement::hexahedron, cells).value == Approx(of.reference).epsilon(tolerance));
}

TEST_CASE("Tears of finer cells take the work of their tissue's toughness", "[.soak]") {
  const auto [name, cells] = GENERATE(table<const char*, int>({{"double cantilever, work per area, 10 mm/s", 8},
                                                               {"trouser tear, force of a leg", 4},
                                                               {"trouser tear, work per area", 4}}));
  CAPTURE(name, cells);
  const TissueCase& of = tissue_case(name);
  CHECK(of.solve(TissueElement::hexahedron, cells).value == Approx(of.reference).epsilon(0.06));
}
