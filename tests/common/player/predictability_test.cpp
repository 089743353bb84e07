// How much of a hand's motion is predictable, against closed forms.
#include "common/player/predictability.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "tests/support/circling_hand.hpp"

using namespace palpate;
using test::kRadiusM;
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

TEST_CASE("A hand that swings within the horizon is expected to come back to its mean, one that moves slowly is not") {
  const double hz = GENERATE(0.5, 1.5, 3.0, 5.0);
  const Vec3 centre(0.1, 0, -0.2);
  CAPTURE(hz);
  Predictability hand;
  CHECK(hand.back(centre).norm() == 0);
  for (int k = 0; k < 600; ++k) hand.add(centre + on_circle(2 * M_PI * hz, 0.01 * k), 0.15);
  const double share = share_on_circle(2 * M_PI * hz, 0.15);
  // The low-passed circle is a circle, smaller by the filter's gain and later by its phase.
  const double part = 0.01 / (Predictability::kMeanS + 0.01);
  const std::complex<double> gain = part / (1.0 - (1 - part) * std::polar(1.0, -2 * M_PI * hz * 0.01));
  const Vec3 here = on_circle(2 * M_PI * hz, 5.99);
  const std::complex<double> mean = gain * std::complex<double>(here.x(), here.y());
  const Vec3 back = std::max(0.0, 1 - 1.5 * share) * (Vec3(mean.real(), mean.imag(), 0) - here);
  CHECK((hand.back(centre + here) - back).norm() < 1e-6 * kRadiusM);
  if (hz < 1) CHECK(hand.back(centre + here).norm() == 0);
  if (hz * 0.15 > 0.5) CHECK(hand.back(centre + here).norm() > 0.8 * kRadiusM);
}

TEST_CASE("Predictability forgets how the hand moved before") {
  Predictability hand;
  for (int k = 0; k < 200; ++k) hand.add(on_circle(2 * M_PI * 5, 0.01 * k), 0.1);
  CHECK(hand.share() < 0.1);
  for (int k = 0; k < 200; ++k) hand.add(Vec3(1e-3 * k, 0, 0), 0.1);
  CHECK(hand.share() > 0.95);
}
