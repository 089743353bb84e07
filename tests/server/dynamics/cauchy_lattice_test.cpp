// Lattices of springs of young_pa in bending: their error against the continuum is that of the coarseness of their cells.
#include <catch2/catch.hpp>

#include "tests/support/hanging_bar.hpp"

using namespace palpate;
using namespace palpate::test;

TEST_CASE(
    "A hanging bar of springs of young_pa is within 5 % of finite elements at Cauchy's ratio with eight cells of its height") {
  const double elements =
      hanging_bar_sag_mm("[21, 7, 5]", R"("solid": {"element": "hexahedron", "young_pa": 400000, "poisson": 0.25})");
  const double four = hanging_bar_sag_mm("[21, 7, 5]", R"("young_pa": 400000)"),
               eight = hanging_bar_sag_mm("[41, 13, 9]", R"("young_pa": 400000)");
  CAPTURE(elements, four, eight);
  CHECK(eight == Approx(elements).epsilon(0.05));
  CHECK(std::abs(eight - elements) < std::abs(four - elements));
  // Flat cells: 2.5 x 3.75 x 3.33 mm.
  CHECK(hanging_bar_sag_mm("[41, 9, 7]", R"("young_pa": 400000)") == Approx(elements).epsilon(0.05));
}
