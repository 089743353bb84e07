// Predicted positions of tools: server/reduction/tool_prediction.hpp.
#include "server/reduction/tool_prediction.hpp"

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

TEST_CASE("A hand that moves on starts as it goes, its velocity is its derivative, and it rests when nothing is known of it") {
  const ToolAt now{Vec3(0.01, 0.02, 0.03), Vec3(0.1, -0.2, 0.3)};
  const Vec3 acceleration(2, 1, -4);
  CHECK(moved_on(now, acceleration, 0).position == now.position);
  CHECK(moved_on(now, acceleration, 0).velocity == now.velocity);
  constexpr double kH = 1e-6;
  for (const double t : {0.01, kAccelerationTimeS, 0.1, kPredictionMostS - 1e-3}) {
    const Vec3 rate = (moved_on(now, acceleration, t + kH).position - moved_on(now, acceleration, t - kH).position) / (2 * kH);
    CHECK((moved_on(now, acceleration, t).velocity - rate).norm() < 1e-5);
  }
  CHECK((moved_on(now, acceleration, 0.02).velocity - now.velocity - 0.02 * acceleration).norm() < 1e-12);
  CHECK((moved_on(now, acceleration, 0.2).velocity - now.velocity - kAccelerationTimeS * acceleration).norm() < 1e-12);
  CHECK(moved_on(now, acceleration, 1).velocity == Vec3(0, 0, 0));
  CHECK((moved_on(now, acceleration, 1).position - moved_on(now, acceleration, kPredictionMostS).position).norm() < 1e-12);
}
