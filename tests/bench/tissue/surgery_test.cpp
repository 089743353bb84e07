// Needle and blade against their laws, on the smallest meshes of palpate-lab surgery.
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
