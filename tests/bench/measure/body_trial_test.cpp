// Trials of the full model alone.
#include "bench/measure/body_trial.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace palpate;

TEST_CASE("A block of ordinary tissue is back at rest within two seconds of a deep press, and one without dampers on its way") {
  BodyTrial trial;
  trial.amount = 0.8;
  trial.zeta = 0.3;
  const BodyTrialResult damped = try_body(trial);
  CHECK(damped.end == BodyEnd::back);
  CHECK(damped.left < 1e-4);
  trial.zeta = 0;
  trial.amount = 0.2;
  trial.step_ms = 1;
  const BodyTrialResult free = try_body(trial);
  CHECK(free.growth < 1e-3);
  CHECK(free.left > 0.5);
  CHECK(free.end == BodyEnd::on_its_way);
}

TEST_CASE("The hardest trials of the sweep hold, and none is given up") {
  using enum Treatment;
  constexpr double kMilligram = 1e-6;
  const auto trial = [](Treatment treatment, double ratio, double zeta, double mass_kg, double step_ms) {
    const double amount = treatment == compress ? 0.9 : 2;
    return BodyTrial{treatment, SpringLaw::linear, amount, ratio, zeta, mass_kg, mass_kg, step_ms, 1};
  };
  for (const BodyTrial& t : {trial(compress, 1, 10, 10, 50), trial(invert, 1, 0, 10, 50), trial(pull, 1e4, 0, 10, 50),
                             trial(pull, 1e4, 0, kMilligram, 50), trial(compress, 1e4, 0, kMilligram, 50),
                             trial(invert, 1e4, 0, kMilligram, 50), trial(compress, 1e4, 0, kMilligram, 0.1)}) {
    CAPTURE(name_of(t.treatment), t.ratio, t.zeta, t.mass_min_kg, t.step_ms);
    const BodyTrialResult r = try_body(t);
    CHECK(r.holds(t));
    CHECK(r.failed == 0);
  }
}

TEST_CASE("A light block that is let go of in steps of many of its periods comes back, and is not thrown through its base") {
  const BodyTrial t{Treatment::compress, SpringLaw::linear, 0.4, 2.2, 0.77, 2.7e-6, 2.7e-6, 32, 392};
  const BodyTrialResult r = try_body(t);
  CHECK(r.holds(t));
  CHECK(r.end == BodyEnd::back);
}

TEST_CASE("The draws of a trial stay within what it names, and its dampers have the wanted ratio") {
  BodyTrial trial;
  trial.ratio = 1e4;
  trial.mass_min_kg = 1e-6;
  trial.mass_max_kg = 10;
  trial.zeta = 2;
  const LumpedBody body = trial_body(trial);
  double softest = 1e300, stiffest = 0;
  for (const Element& e : body.elements) {
    softest = std::min(softest, e.stiffness_n_m);
    stiffest = std::max(stiffest, e.stiffness_n_m);
    CHECK(e.damping_n_s_m / (2 * std::sqrt(e.stiffness_n_m * 0.5 * (body.masses_kg[e.a] + body.masses_kg[e.b]))) == Approx(2));
  }
  CHECK(softest >= 10);
  CHECK(stiffest <= 1e5);
  CHECK(stiffest / softest > 1e3);
  for (const double m : body.masses_kg) CHECK((m >= 1e-6 && m <= 10));
}
