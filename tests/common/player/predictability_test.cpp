// How much of a hand's motion is predictable, against closed forms.
#include "common/player/predictability.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/circling_hand.hpp"

using namespace palpate;
using test::on_circle;
using test::share_on_circle;

TEST_CASE("A steady motion is predictable as a whole, a circle as far as its radius and the horizon say") {
  Predictability line;
  CHECK(line.share() == 1);
  for (int k = 0; k < 100; ++k) line.add(Vec3(1e-4 * k, 0, 2e-4 * k), 0.1);
  CHECK(line.share() == Approx(1).margin(1e-9));
  const double hz = GENERATE(0.7, 1.5, 3.0, 5.0), horizon_s = GENERATE(0.05, 0.1, 0.25);
  CAPTURE(hz, horizon_s);
  Predictability circle;
  for (int k = 0; k < 200; ++k) circle.add(on_circle(2 * M_PI * hz, 0.01 * k), horizon_s);
  CHECK(circle.share() == Approx(share_on_circle(2 * M_PI * hz, horizon_s)).margin(1e-9));
  // Of a slow motion all, of a fast one nothing that would make it larger.
  if (hz * horizon_s < 0.05) CHECK(circle.share() > 0.9);
  if (hz * horizon_s > 0.5) CHECK(circle.share() < 0.1);
}

TEST_CASE("Predictability forgets how the hand moved before") {
  Predictability hand;
  for (int k = 0; k < 200; ++k) hand.add(on_circle(2 * M_PI * 5, 0.01 * k), 0.1);
  CHECK(hand.share() < 0.1);
  for (int k = 0; k < 200; ++k) hand.add(Vec3(1e-3 * k, 0, 0), 0.1);
  CHECK(hand.share() > 0.95);
}
