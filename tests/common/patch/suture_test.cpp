// The law of a thread: Euler's and Eytelwein's ratio, lengths that are kept, dissipation, tangents.
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "common/base/random.hpp"
#include "common/patch/suture.hpp"

using namespace palpate;

namespace {

double total(const OfSpans& lengths) { return std::accumulate(lengths.begin(), lengths.end(), 0.0); }

double energy_j(const SutureLaw& law, const OfSpans& length_m, const SutureShape& shape) {
  double energy = 0;
  for (std::size_t i = 1; i < static_cast<std::size_t>(law.bites) + (shape.held ? 1 : 0); ++i) {
    const double tension_n = law.stiffness_n_m * std::max(0.0, shape.distance_m[i] - length_m[i]);
    energy += 0.5 * tension_n * tension_n / law.stiffness_n_m;
  }
  return energy;
}

/// Bites on a circle, so that the thread turns by `angle` at each.
SuturePlace around(int bites, double angle) {
  SuturePlace place;
  place.held = true;
  place.points.fill(Vec3::Zero());
  Vec3 at = Vec3::Zero();
  for (std::size_t j = 0; j <= static_cast<std::size_t>(bites); ++j) {
    place.points[j] = at;
    at += 0.01 * Vec3(std::cos(static_cast<double>(j) * angle), std::sin(static_cast<double>(j) * angle), 0);
  }
  return place;
}

}  // namespace

TEST_CASE("A thread that is pulled around bites has the tension of Euler and Eytelwein at each") {
  const double angle = GENERATE(0.3, 1.2, 3.0), friction = GENERATE(0.0, 0.1, 0.4);
  SutureLaw law{5, 2000, friction, 0, true, false};
  SuturePlace place = around(5, angle);
  OfSpans lengths{};
  for (std::size_t i = 1; i <= 5; ++i) lengths[i] = 0.01;
  const Vec3 pull = (place.points[5] - place.points[4]).normalized();
  for (int step = 0; step < 200; ++step) {
    place.points[5] += 1e-4 * pull;
    lengths = pull_of(law, lengths, shape_of(law, place)).length_m;
  }
  const SuturePull end = pull_of(law, lengths, shape_of(law, place));
  CHECK(end.tension_n[5] > 1);
  for (std::size_t i = 1; i < 5; ++i)
    CHECK(end.tension_n[i + 1] / end.tension_n[i] == Approx(std::exp(friction * angle)).epsilon(1e-3));
  if (friction == 0) return;
  // Let go a little, and it sticks.
  place.points[5] -= 1e-6 * pull;
  CHECK(pull_of(law, lengths, shape_of(law, place)).tension_n[4] == Approx(end.tension_n[4]));
}

TEST_CASE("Whatever moves, a thread keeps its length to rounding, never gains energy by a slide, and obeys its bounds") {
  Random random(7);
  for (int trial = 0; trial < 300; ++trial) {
    const int bites = 2 + trial % 7;
    const SutureLaw law{bites,
                        random.uniform(100, 5000),
                        random.uniform(0, 0.5),
                        random.uniform(0, 0.2),
                        random.uniform(0, 1) < 0.5,
                        random.uniform(0, 1) < 0.3};
    OfSpans lengths{};
    SuturePlace place;
    place.held = trial % 3 != 0;
    const auto n = static_cast<std::size_t>(bites);
    for (std::size_t j = 0; j <= n; ++j) {
      place.points[j] = Vec3(random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02));
      lengths[j] = random.uniform(0, 0.03);
    }
    for (int step = 0; step < 10; ++step) {
      for (std::size_t j = 0; j <= n; ++j)
        place.points[j] += Vec3(random.uniform(-2e-3, 2e-3), random.uniform(-2e-3, 2e-3), random.uniform(-2e-3, 2e-3));
      const SutureShape shape = shape_of(law, place);
      const SuturePull pull = pull_of(law, lengths, shape);
      CHECK(std::abs(total(pull.length_m) - total(lengths)) < 1e-15);
      CHECK(energy_j(law, pull.length_m, shape) <= energy_j(law, lengths, shape) * (1 + 1e-12));
      for (std::size_t j = 0; j < n; ++j) {
        CHECK(pull.length_m[j] >= 0);
        const bool tied = (j == 0 && law.first_tied) || (j + 1 == n && law.last_tied);
        if (tied && j == 0) CHECK(pull.length_m[0] == lengths[0]);
        if (tied) continue;
        const double low = pull.tension_n[j], high = pull.tension_n[j + 1], r = shape.ratio[j], d = law.drag_n;
        // A span without length left gives none.
        if (pull.length_m[j] > 1e-12) CHECK(high <= r * low + d + 1e-6);
        if (pull.length_m[j + 1] > 1e-12) CHECK(low <= r * high + d + 1e-6);
      }
      lengths = pull.length_m;
    }
  }
}

TEST_CASE("The tangents of a thread that slides or sticks are its finite differences") {
  const bool slides = GENERATE(false, true);
  const SutureLaw law{4, 1500, 0.2, 0.03, true, false};
  SuturePlace place = around(4, 1.1);
  OfSpans lengths{};
  for (std::size_t i = 1; i <= 4; ++i) lengths[i] = 0.0095;
  if (slides) place.points[4] += 0.006 * (place.points[4] - place.points[3]).normalized();
  SutureShape shape = shape_of(law, place);
  const SuturePull pull = pull_of(law, lengths, shape);
  CHECK((pull.group[4] == pull.group[1]) == slides);
  constexpr double kStepM = 1e-8;
  for (std::size_t m = 1; m <= 4; ++m) {
    SutureShape moved = shape;
    moved.distance_m[m] += kStepM;
    const SuturePull then = pull_of(law, lengths, moved);
    for (std::size_t i = 1; i <= 4; ++i)
      CHECK((then.tension_n[i] - pull.tension_n[i]) / kStepM == Approx(pull.tangent(i, m)).margin(0.01 * law.stiffness_n_m));
  }
}

TEST_CASE("A barbed thread that is let go holds what it was pulled to") {
  const bool barbed = GENERATE(false, true);
  const SutureLaw law{3, 1000, 0.1, 0, true, false, barbed};
  SuturePlace place = around(3, 2);
  OfSpans lengths{0, 0.01, 0.01, 0.01};
  place.points[3] += 0.004 * (place.points[3] - place.points[2]).normalized();
  const SuturePull pulled = pull_of(law, lengths, shape_of(law, place));
  REQUIRE(pulled.tension_n[1] > 0.5);
  place.held = false;
  const SuturePull left = pull_of(law, pulled.length_m, shape_of(law, place));
  CHECK(left.tension_n[3] == 0);
  for (const std::size_t i : {1, 2}) CHECK(left.tension_n[i] == Approx(barbed ? pulled.tension_n[i] : 0).margin(1e-9));
}

TEST_CASE("A tail feeds a thread that is pulled until it is used up, with no more than its drag") {
  const SutureLaw law{2, 1000, 0, 0.1, false, false};
  SuturePlace place = around(2, 0);
  OfSpans lengths{0.005, 0.01, 0.01};
  for (int step = 0; step < 40; ++step) {
    place.points[2].x() += 1e-4;
    const SuturePull pull = pull_of(law, lengths, shape_of(law, place));
    lengths = pull.length_m;
    CHECK(pull.tension_n[2] <= 0.2 + 1e-9);
  }
  CHECK(lengths[0] == Approx(0.005 - 0.004).margin(3.1e-4));
  place.points[2].x() += 0.003;
  const SuturePull pull = pull_of(law, lengths, shape_of(law, place));
  CHECK(pull.length_m[0] == 0);
  CHECK(pull.tension_n[2] > 0.5);
}

TEST_CASE("A thread that cuts through tissue bears J d at most at each bite, and gives no less than J d a length of its energy") {
  Random random(11);
  int torn = 0, beyond = 0, bounds = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const int bites = 1 + trial % 8;
    const SutureLaw law{bites,
                        random.uniform(100, 5000),
                        random.uniform(0, 0.3),
                        random.uniform(0, 0.1),
                        random.uniform(0, 1) < 0.7,
                        random.uniform(0, 1) < 0.3,
                        false,
                        random.uniform(0.05, 0.5)};
    SuturePlace place;
    place.points.fill(Vec3::Zero());
    place.held = trial % 3 != 0;
    const auto n = static_cast<std::size_t>(bites);
    for (std::size_t j = 0; j <= n; ++j)
      place.points[j] = Vec3(0.01 * static_cast<double>(j), random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01));
    OfSpans lengths = shape_of(law, place).distance_m;
    lengths[0] = 0.01;
    if (!place.held) lengths[n] = 0.01;
    const Vec3 pull(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    for (int step = 0; step < 40; ++step) {
      for (std::size_t j = 0; j < n; ++j)
        place.points[j] += 5e-5 * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      place.points[n] += 3e-4 * pull;
      const auto energy = [&](const SuturePull& of) {
        double sum = 0;
        for (const double tension_n : of.tension_n) sum += 0.5 * tension_n * tension_n / law.stiffness_n_m;
        return sum;
      };
      const SuturePull before = pull_of(law, lengths, shape_of(law, place));
      const SutureTear tear = tear_of(law, lengths, place);
      CHECK(std::abs(total(tear.spans_m) - total(lengths)) < 1e-14);
      for (std::size_t j = 0; j < n; ++j) place.points[j] += tear.way[j];
      const SutureShape shape = shape_of(law, place);
      const SuturePull after = pull_of(law, tear.spans_m, shape);
      for (std::size_t j = 0; j < n; ++j, ++bounds)
        beyond += (after.tension_n[j + 1] * shape.along[j + 1] - after.tension_n[j] * shape.along[j]).norm() > law.tear_n * 1.01;
      CHECK(energy(before) - energy(after) >= law.tear_n * tear.length_m - 1e-12);
      torn += tear.length_m > 0;
      lengths = after.length_m;
    }
    SutureLaw holds = law;
    holds.tear_n = 0;
    CHECK(tear_of(holds, lengths, place).length_m == 0);
  }
  CHECK(torn > 1000);
  CHECK(bounds > 10000);
  CHECK(beyond == 0);
}

TEST_CASE("A thread that cuts is brought to J d at each bite by calls of bounded work, too") {
  Random random(5);
  constexpr int kMost = 12;
  int at_most = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const SutureLaw law{8, 2000, random.uniform(0, 0.3), 0.01, true, false, false, std::pow(10.0, random.uniform(-3, 0))};
    SuturePlace place;
    place.points.fill(Vec3::Zero());
    place.held = true;
    for (std::size_t j = 0; j <= 8; ++j)
      place.points[j] = Vec3(0.01 * static_cast<double>(j), random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01));
    OfSpans lengths = shape_of(law, place).distance_m;
    lengths[0] = 0.01;
    place.points[8] += 5e-3 * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    for (int call = 0; call < 100; ++call) {
      const SutureTear tear = tear_of(law, lengths, place, kMost);
      CHECK(tear.settled <= kMost);
      at_most += tear.settled == kMost;
      for (std::size_t j = 0; j < 8; ++j) place.points[j] += tear.way[j];
      lengths = tear.spans_m;
      if (tear.settled < kMost) break;
    }
    const SutureShape shape = shape_of(law, place);
    const SuturePull end = pull_of(law, lengths, shape);
    for (std::size_t j = 0; j < 8; ++j)
      CHECK((end.tension_n[j + 1] * shape.along[j + 1] - end.tension_n[j] * shape.along[j]).norm() < law.tear_n + 1e-4);
  }
  CHECK(at_most > 20);
}
