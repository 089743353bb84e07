// Leapfrog against closed forms of one mode, against TR-BDF2 at a step at which that has converged, and against itself.

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/explicit_steppers.hpp"
#include "tests/support/tool_bench.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kTopM = 3 * kSpacingM;

}  // namespace

TEST_CASE("The stable step is 2 / w without dampers, and 1 / g where they rule") {
  CHECK(leapfrog_step_s(400.0 * 400.0, 0) == Approx(2.0 / 400).epsilon(1e-6));
  CHECK(leapfrog_step_s(1e-6, 500) == Approx(1.0 / 500).epsilon(1e-4));
  CHECK(leapfrog_step_s(400.0 * 400.0, 300) < leapfrog_step_s(400.0 * 400.0, 100));
}

TEST_CASE("A body held by a tool is moved as by an implicit integrator that has converged, to second order") {
  ToolBench bench(box_body(4, 4, 4));
  Leapfrog leapfrog(bench.dynamics, bench.skin);
  const Vec3 home = bench.body.nodes[bench.port.node];
  const auto way = [&](double t) { return Vec3(home + Vec3(0.004 * std::sin(12 * t), 0.003 * (1 - std::cos(9 * t)), 0)); };
  const auto truth = bench.felt(bench.fine, 0.0005, 0.5, way);
  const double h = leapfrog.plan(1, ContactKind::touch).h;
  REQUIRE(h > 2e-4);
  const double whole = ToolBench::apart(bench.felt(leapfrog, h, 0.5, way), truth);
  CHECK(whole < 0.01);
  const double coarse = ToolBench::apart(bench.felt(leapfrog, h, 0.5, way), bench.felt(leapfrog, h / 8, 0.5, way));
  const double halved = ToolBench::apart(bench.felt(leapfrog, h / 2, 0.5, way), bench.felt(leapfrog, h / 8, 0.5, way));
  CHECK(coarse / halved > 3);  // 63 / 15 for second order
}

TEST_CASE("A tool that presses, strokes and lets go feels what it feels with an implicit integrator that has converged") {
  ToolBench bench(box_body(4, 4, 4), ContactKind::touch);
  Leapfrog leapfrog(bench.dynamics, bench.skin);
  const auto way = [](double t) {
    const double in_m = 0.005 * std::min({1.0, t / 0.1, std::max(0.0, (0.45 - t) / 0.05)});
    return Vec3(0.02 + 0.05 * std::max(0.0, t - 0.15), 0.031, kTopM + 0.001 - in_m);
  };
  const auto truth = bench.felt(bench.fine, 0.0005, 0.6, way);
  const auto felt = bench.felt(leapfrog, 0.010, 0.6, way);
  REQUIRE(truth[30].norm() > 0.3);
  CHECK(ToolBench::apart(felt, truth) < 0.02);
  CHECK(felt.back() == Vec3::Zero());
}

TEST_CASE("A sphere is met as soon as it touches, from whatever height it comes") {
  constexpr double kRadiusM = 0.008, kSpeedMS = 0.2, kSureN = 0.3;  // 0.4 mm in: 2 ms of its way
  ToolBench bench(box_body(4, 4, 4), ContactKind::touch);
  bench.port.sphere.radius_m = kRadiusM;
  int met = 0;
  for (double above_m = 0.001; above_m < 0.008; above_m += 0.0005) {
    Leapfrog leapfrog(bench.dynamics, bench.skin);
    const auto way = [&](double t) { return Vec3(0.02, 0.031, kTopM + kRadiusM + above_m - kSpeedMS * t); };
    const auto truth = bench.felt(bench.fine, 0.0005, 0.05, way);
    const auto felt = bench.felt(leapfrog, 0.010, 0.05, way);
    for (std::size_t k = 0; k < truth.size(); ++k) {
      if (truth[k].norm() < kSureN) continue;
      ++met;
      CAPTURE(above_m, k);
      CHECK((felt[k] - truth[k]).norm() < 0.1 * truth[k].norm());
    }
  }
  CHECK(met > 20);
}

TEST_CASE("A body without dampers swings on at its energy") {
  LumpedBody body = box_body(4, 4, 4);
  for (Element& e : body.elements) e.damping_n_s_m = 0;
  const Dynamics dynamics(body);
  Leapfrog leapfrog(dynamics, Skin());
  BodyState state = random_state(dynamics, 3, 0.001, 0);
  std::vector<ToolPort> ports;
  const double begin_j = dynamics.energy(state);
  double least_j = begin_j, most_j = begin_j;
  for (int k = 1; k <= 300; ++k) {
    REQUIRE(leapfrog.advance(state, ports, 0.010 * k, 0.010, {}).cut_steps == 0);
    least_j = std::min(least_j, dynamics.energy(state));
    most_j = std::max(most_j, dynamics.energy(state));
  }
  CHECK(most_j < 1.3 * begin_j);
  CHECK(least_j > 0.7 * begin_j);
}
