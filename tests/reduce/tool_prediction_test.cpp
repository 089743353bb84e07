// Where tools may go: server/reduce/tool_prediction.hpp.
#include "server/reduce/tool_prediction.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

TEST_CASE("How fast a hand is that speeds up is the derivative of how far it gets, and it stops where it gets no further") {
  constexpr double kStepS = 1e-6;
  for (const double t : {0.01, 0.1, 0.2, 0.24, 0.25, 0.5}) {
    const double slope = (accelerated_distance(t + kStepS) - accelerated_distance(t - kStepS)) / (2 * kStepS);
    CAPTURE(t);
    CHECK(accelerated_speed(t) == Approx(slope).margin(1e-9));
  }
  CHECK(accelerated_distance(10) == accelerated_distance(0.25));
}
