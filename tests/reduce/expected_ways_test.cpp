// Where hands may go: server/reduce/expected_ways.hpp.
#include "server/reduce/expected_ways.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

TEST_CASE("How fast a hand is that speeds up is the derivative of how far it gets, and it stops where it gets no further") {
  constexpr double kStepS = 1e-6;
  for (const double t : {0.01, 0.1, 0.2, 0.24, 0.25, 0.5}) {
    const double slope = (sped_up(t + kStepS) - sped_up(t - kStepS)) / (2 * kStepS);
    CAPTURE(t);
    CHECK(speed_of_speeding_up(t) == Approx(slope).margin(1e-9));
  }
  CHECK(sped_up(10) == sped_up(0.25));
}
