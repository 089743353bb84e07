// Figure 16: stiffness of lattice blocks against their number of elements.
#include "bench/paper/block_stiffness.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

TEST_CASE("In one dimension every loading is springs in series", "[scaling]") {
  for (const BlockLoading loading : kBlockLoadings)
    for (const int m : {1, 2, 5, 9}) CHECK(block_stiffness(loading, 1, m) == Approx(1.0 / m).epsilon(1e-9));
}

TEST_CASE("One cell under a plate is its upright and diagonal springs", "[scaling]") {
  // Square: two upright springs and two diagonals at 45 degrees give 2 + 2/2 along the axis; cube: 4 + 8/2 + 4/3.
  CHECK(block_stiffness(BlockLoading::plate, 2, 1) == Approx(3).epsilon(1e-9));
  CHECK(block_stiffness(BlockLoading::plate, 3, 1) == Approx(4 + 4 + 4.0 / 3).epsilon(1e-9));
}

TEST_CASE("A plate-loaded block grows as the number of elements to the power d - 2, by a modulus between free and confined sides",
          "[scaling]") {
  // Moduli of the lattices, k/h in three dimensions and k in two: E = 2.7, C11 = 4.33; E = 1.5, C11 = 2.
  const double five = block_stiffness(BlockLoading::plate, 3, 5), six = block_stiffness(BlockLoading::plate, 3, 6),
               seven = block_stiffness(BlockLoading::plate, 3, 7);
  CHECK(seven - six == Approx(six - five).epsilon(0.01));
  CHECK(seven - six > 2.7);
  CHECK(seven - six < 4.33);
  const double fifteen = block_stiffness(BlockLoading::plate, 2, 15), sixteen = block_stiffness(BlockLoading::plate, 2, 16);
  CHECK(sixteen == Approx(fifteen).epsilon(0.01));
  CHECK(sixteen > 1.5);
  CHECK(sixteen < 2);
}

TEST_CASE("The compliance of a block grows with its length, the slower the more dimensions it spreads in", "[scaling]") {
  const BlockCurve plane = block_curve(BlockLoading::contact, 2, 8), space = block_curve(BlockLoading::contact, 3, 4);
  for (std::size_t i = 1; i < plane.stiffness.size(); ++i) CHECK(plane.stiffness[i] < plane.stiffness[i - 1]);
  for (std::size_t i = 1; i < space.stiffness.size(); ++i)
    CHECK(space.stiffness[i] / space.stiffness[0] > plane.stiffness[i] / plane.stiffness[0]);
}

TEST_CASE("The two-layer model scales its outer elements as lattices do", "[scaling]") {
  CHECK(scaling_error(block_curve(BlockLoading::contact, 1, 10)) < 1e-9);
  CHECK(scaling_error(block_curve(BlockLoading::contact, 2, 16)) < 0.025);
  CHECK(scaling_error(block_curve(BlockLoading::contact, 3, 5)) < 0.002);
}
