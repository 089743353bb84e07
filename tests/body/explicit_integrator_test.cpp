// Leapfrog against closed forms of one mode, against TR-BDF2 at a step at which that has converged, and against itself.
#include "server/body/explicit_integrator.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "common/io/spinning_crew.hpp"
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
  ExplicitIntegrator leapfrog(bench.dynamics, bench.skin);
  const Vec3 home = bench.body.nodes[bench.port.node];
  const auto way = [&](double t) { return Vec3(home + Vec3(0.004 * std::sin(12 * t), 0.003 * (1 - std::cos(9 * t)), 0)); };
  const auto truth = bench.felt(bench.fine, 0.0005, 0.5, way);
  const double h = leapfrog.step_s();
  REQUIRE(h > 2e-4);
  const double whole = ToolBench::apart(bench.felt(leapfrog, h, 0.5, way), truth);
  CHECK(whole < 0.01);
  const double coarse = ToolBench::apart(bench.felt(leapfrog, h, 0.5, way), bench.felt(leapfrog, h / 8, 0.5, way));
  const double halved = ToolBench::apart(bench.felt(leapfrog, h / 2, 0.5, way), bench.felt(leapfrog, h / 8, 0.5, way));
  CHECK(coarse / halved > 3);  // 63 / 15 for second order
}

TEST_CASE("A tool that presses, strokes and lets go feels what it feels with an implicit integrator that has converged") {
  ToolBench bench(box_body(4, 4, 4), ContactKind::touch);
  ExplicitIntegrator leapfrog(bench.dynamics, bench.skin);
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

TEST_CASE("A body without dampers swings on at its energy") {
  LumpedBody body = box_body(4, 4, 4);
  for (Element& e : body.elements) e.damping_n_s_m = 0;
  const Dynamics dynamics(body);
  ExplicitIntegrator leapfrog(dynamics, Skin());
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

TEST_CASE("Where its steps would be too short, a frame is left to the implicit integrator and told") {
  LumpedBody body = box_body(4, 4, 4);
  body.law = SpringLaw::stiffening;
  body.stiffening = 4000;
  const Dynamics dynamics(body);
  ExplicitIntegrator leapfrog(dynamics, Skin());
  BodyState state = dynamics.rest_state();
  state.x *= 1.2;  // strains of 20 %: springs 480 times stiffer
  std::vector<ToolPort> ports;
  const AdvanceReport report = leapfrog.advance(state, ports, 0.020, 0.010, {});
  CHECK(report.cut_steps > 0);
  CHECK(report.newton_iterations > 0);
  CHECK(state.x.allFinite());
}

TEST_CASE("A body that threads share moves to the same bits as one that one thread moves") {
  const LumpedBody body = box_body(24, 22, 22);
  const Dynamics dynamics(body);
  const Skin skin(body);
  const auto moved_by = [&](std::size_t threads) {
    SpinningCrew crew(threads);
    ExplicitIntegrator leapfrog(dynamics, skin);
    REQUIRE(leapfrog.springs() >= ExplicitBody::kWorthSharing);
    leapfrog.employ(crew);
    BodyState state = random_state(dynamics, 3, 0.001, 0.1);
    std::vector<ToolPort> ports(1);
    ports[0].parameters = {800, 0.3};
    const auto tool = [](std::size_t, double t) { return ToolAt{Vec3(0.1, 0.1, 21 * kSpacingM - 0.2 * t), Vec3(0, 0, -0.2)}; };
    REQUIRE(leapfrog.advance(state, ports, 0.010, 0.010, tool).cut_steps == 0);
    REQUIRE(ports[0].touching);
    return state;
  };
  const BodyState one = moved_by(1);
  for (const std::size_t threads : {2, 3, 4}) {
    const BodyState shared = moved_by(threads);
    CHECK(shared.x == one.x);
    CHECK(shared.v == one.v);
  }
}
