// A tool that slides without friction pushes along the normal alone, which turns as it slides. Accuracy of each integrator in
// this: the implicit one against itself in shorter steps, the others against the implicit one in much shorter ones.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tests/support/explicit_steppers.hpp"
#include "tests/support/tool_bench.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct Stroke {
  ToolBench bench;
  explicit Stroke(LumpedBody body) : bench(std::move(body), ContactKind::touch) { bench.port.parameters = {1500, 0}; }

  /// Pressed in smoothly, then to and fro over its own indentation.
  std::vector<Vec3> felt(Stepper& stepper, double step_s) const {
    const double top_m = 3 * kSpacingM;
    return bench.felt(stepper, step_s, 0.6, [&](double t) {
      const double in = std::pow(std::sin(0.5 * std::numbers::pi * std::min(1.0, t / 0.2)), 2);
      const double aside = 0.008 * (1 - std::cos(2 * std::numbers::pi * std::max(0.0, t - 0.2) / 0.4));
      return Vec3(0.013 + aside, 0.031, top_m + 1e-5 - 0.009 * in);
    });
  }
  std::vector<Vec3> truth() {
    Integrator finest(bench.dynamics, bench.skin, {0.0001, 1e-11});
    return felt(finest, 0.0001);
  }
};

}  // namespace

TEST_CASE("A stroke without friction is stepped implicitly to second order") {
  Stroke stroke(box_body(4, 4, 4));
  Integrator integrator(stroke.bench.dynamics, stroke.bench.skin, {0.004, 1e-11});
  const auto truth = stroke.truth();
  REQUIRE(truth.back().norm() > 0.3);
  const double whole = ToolBench::apart(stroke.felt(integrator, 0.002), truth),
               half = ToolBench::apart(stroke.felt(integrator, 0.001), truth);
  CHECK(whole < 0.002);
  CHECK(half < 0.4 * whole);
}

TEST_CASE("A stroke without friction is felt in steps of leapfrog as in implicit ones that have converged") {
  Stroke stroke(box_body(4, 4, 4));
  Leapfrog leapfrog(stroke.bench.dynamics, stroke.bench.skin);
  CHECK(ToolBench::apart(stroke.felt(leapfrog, 0.010), stroke.truth()) < 0.0015);
}

TEST_CASE("A stroke without friction over a damped body is felt in stabilised steps as in implicit ones that have converged") {
  Stroke stroke(box_body(4, 4, 4, 60, 6));
  Stabilised stabilised(stroke.bench.dynamics, stroke.bench.skin);
  CHECK(ToolBench::apart(stroke.felt(stabilised, 0.010), stroke.truth()) < 0.0025);
}

TEST_CASE("A tool that lets go and touches again within an advance of leapfrog pushes as in one advance after the other") {
  Stroke stroke(box_body(4, 4, 4));
  const ToolBench& bench = stroke.bench;
  const auto tool = [](std::size_t, double t) {
    // deep, away at 0.1 s within a tick, and slowly back
    const double in_m = t < 0.1 ? 0.009 * t / 0.1 : std::max(-0.003, 0.02 * (t - 0.5));
    return ToolAt{Vec3(0.031, 0.031, 3 * kSpacingM - in_m), Vec3::Zero()};
  };
  const auto end = [&](double each_s) {
    Leapfrog leapfrog(bench.dynamics, bench.skin);
    BodyState state = bench.dynamics.rest_state();
    std::vector<ToolPort> ports{bench.port};
    for (int k = 1; k * each_s <= 0.51 + 1e-9; ++k) REQUIRE(leapfrog.advance(state, ports, k * each_s, 0.010, tool).converged);
    return std::pair{state.v, ports[0].lambda};
  };
  const auto [v, lambda] = end(0.51);
  const auto [v_each, lambda_each] = end(0.01);
  CHECK(lambda_each.norm() > 0.01);
  CHECK((lambda - lambda_each).norm() < 0.05 * lambda_each.norm());
  CHECK((v - v_each).norm() < 0.1 * v_each.norm());
}

TEST_CASE("However roughly linear systems are solved, Newton's method ends in the same stroke") {
  Stroke stroke(box_body(4, 4, 4));
  const auto with = [&](double solve_tolerance) {
    Integrator integrator(
        stroke.bench.dynamics, stroke.bench.skin,
        {.tolerance_m = 1e-10, .solver = LinearSolver::Method::conjugate_gradients, .solve_tolerance = solve_tolerance});
    return stroke.felt(integrator, 0.002);
  };
  CHECK(ToolBench::apart(with(0.1), with(1e-4)) < 1e-5);
}

TEST_CASE("A step in which a contact begins is redone in pieces as short as asked for") {
  Stroke stroke(box_body(4, 4, 4));
  const ToolBench& bench = stroke.bench;
  const auto tool = [](std::size_t, double t) { return ToolAt{Vec3(0.031, 0.031, 3 * kSpacingM + 0.001 - 0.1 * t), {}}; };
  const auto meets = [&](double event_step_s, int& steps) {
    Integrator integrator(bench.dynamics, bench.skin, {.tolerance_m = 1e-9, .event_step_s = event_step_s});
    BodyState state = bench.dynamics.rest_state();
    std::vector<ToolPort> ports{bench.port};
    const AdvanceReport report = integrator.advance(state, ports, 0.04, 0.04, tool);
    CHECK(report.converged);
    CHECK(report.cut_steps >= 1);
    CHECK(ports[0].touching);
    steps = report.steps;
    return ports[0].lambda;
  };
  int few = 0, many = 0;
  const Vec3 roughly = meets(0.010, few), finely = meets(0.002, many);
  CHECK(few < many);
  CHECK((roughly - finely).norm() < 0.1 * finely.norm());
}
