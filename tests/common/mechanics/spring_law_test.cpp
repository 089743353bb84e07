// The laws of springs against their formulas, and their slope and energy as derivative and integral of their tension.
#include "common/mechanics/spring_law.hpp"

#include <catch2/catch.hpp>

#include "common/mechanics/lanes.hpp"

using namespace palpate;

namespace {

constexpr double kK = 120, kRest = 0.05;

struct Response {
  double tension, slope;
};

struct Law {
  bool is_skin = false;
  double stiffening = 0;

  Response at(double e) const {
    Response r{};
    if (is_skin)
      ThighSkinSpring{}.respond(kK, e, r.tension, r.slope);
    else
      StiffeningSpring{stiffening}.respond(kK, kRest, e, r.tension, r.slope);
    return r;
  }
  double energy(double e) const {
    return is_skin ? ThighSkinSpring{}.energy(kK, e) : StiffeningSpring{stiffening}.energy(kK, kRest, e);
  }
};

Law any_law() { return GENERATE(Law{false, 0}, Law{false, 4}, Law{true, 0}); }

}  // namespace

TEST_CASE("The laws of springs follow their formulas", "[mechanics]") {
  CHECK(Law{false, 0}.at(0.01).tension == Approx(1.2));
  CHECK(Law{false, 3}.at(0.01).tension == Approx(1.2 * (1 + 3 * 0.04)));
  // f(x) = x / (5.4398 - 0.1418 x) with f'(0) = 1 / 5.4398 N/mm, scaled to 120 N/m at rest.
  CHECK(Law{true, 0}.at(0.010).tension == Approx(0.120 * 5.4398 * 10 / (5.4398 - 1.418)));
}

TEST_CASE("A spring's law begins at its stiffness, is odd, and rises with the slope that it says", "[mechanics]") {
  const Law law = any_law();
  CHECK(law.at(0).slope == Approx(kK));
  CHECK(law.at(0).tension == 0);
  CHECK(law.at(-0.02).tension == Approx(-law.at(0.02).tension));
  for (double e = -0.0805; e < 0.08; e += 0.001) {  // beyond the end of the curve of skin
    constexpr double kStep = 1e-7;
    const double slope = (law.at(e + kStep).tension - law.at(e - kStep).tension) / (2 * kStep);
    CHECK(slope > 0);
    CHECK(law.at(e).slope == Approx(slope).epsilon(1e-6));
  }
}

TEST_CASE("The energy of a spring is the integral of its tension", "[mechanics]") {
  const Law law = any_law();
  CHECK(law.energy(0) == 0);
  // Down to a tenth of a micrometre, and beyond the end of the curve of skin.
  for (const double e : {1e-7, 2e-5, 4e-5, 0.003, 0.03, 0.04, -2e-5, -0.01, -0.04}) {
    constexpr int kPieces = 20000;
    double sum = 0;
    for (int k = 0; k < kPieces; ++k) sum += law.at((k + 0.5) / kPieces * e).tension * e / kPieces;
    CHECK(law.energy(e) == Approx(sum).epsilon(1e-6));
  }
}
