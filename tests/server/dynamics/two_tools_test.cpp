// Several tools on one body, moved as no hand would: the integrator continues, and no tool stays attached to a surface that it
// has passed.
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/random.hpp"
#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct TwoToolsBench {
  LumpedBody body = box_body(4, 4, 4);
  Dynamics dynamics{body};
  Skin skin{body};
  Integrator integrator;
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports;

  TwoToolsBench(std::size_t tools, ContactParameters parameters, LinearSolver::Method solver = LinearSolver::Method::automatic)
      : integrator(dynamics, skin, {0.010, 1e-8, solver}), ports(tools) {
    for (ToolPort& p : ports) p.parameters = parameters;
  }
  AdvanceReport advance(double until_s, const std::function<Vec3(std::size_t, double)>& tool) {
    return integrator.advance(state, ports, until_s, [&](std::size_t k, double t) { return ToolAt{tool(k, t), Vec3::Zero()}; });
  }
  double strain() const { return (state.x - dynamics.rest_state().x).cwiseAbs().maxCoeff(); }
};

constexpr double kTwoToolsTopM = 3 * kSpacingM;

}  // namespace

TEST_CASE("A tool that is thrown through the body and out on its far side does not stay hooked to where it went in") {
  TwoToolsBench bench(2, {1000, 0.3});
  const auto tool = [](std::size_t k, double t) {
    if (k == 1) return Vec3(0.031, 0.010, kTwoToolsTopM - 0.004);
    // 0.3 m/s sideways from x+ through the body, out at x-, and on.
    return Vec3(0.070 - 0.3 * t, 0.031, 0.031);
  };
  for (int ms = 1; ms <= 500; ++ms) REQUIRE(bench.advance(1e-3 * ms, tool).converged);
  CHECK_FALSE(bench.ports[0].touching);
  CHECK(bench.ports[0].lambda.norm() == 0);
  CHECK(bench.ports[1].touching);
}

TEST_CASE("Solved for by iteration, tools that press and slide feel what they feel when it is solved for directly") {
  constexpr double kStiffness_n_m = 1000;
  TwoToolsBench direct(2, {kStiffness_n_m, 0.3}, LinearSolver::Method::direct),
      iterative(2, {kStiffness_n_m, 0.3}, LinearSolver::Method::conjugate_gradients);
  const auto tool = [](std::size_t k, double t) {
    const double in_m = 0.004 * std::min(1.0, t / 0.1), along_m = k == 0 ? 0.012 * std::sin(9 * t) : 0;
    return Vec3(0.015 + 0.03 * static_cast<double>(k), 0.031 + along_m, kTwoToolsTopM + 0.001 - in_m);
  };
  double worst_n = 0, most_n = 0;
  for (int k = 1; k <= 50; ++k) {
    REQUIRE(direct.advance(0.020 * k, tool).converged);
    REQUIRE(iterative.advance(0.020 * k, tool).converged);
    for (std::size_t port = 0; port < 2; ++port) {
      worst_n = std::max(worst_n, (direct.ports[port].lambda - iterative.ports[port].lambda).norm());
      most_n = std::max(most_n, direct.ports[port].lambda.norm());
    }
  }
  REQUIRE(most_n > 0.5);
  // Each contact is closed to kSlipToleranceM, over which its own spring makes this much of a difference.
  CHECK(worst_n < kStiffness_n_m * kSlipToleranceM);
}

TEST_CASE("A deep press ends no contact") {
  TwoToolsBench bench(1, {1000, 0.3});
  const auto tool = [](std::size_t, double t) {
    return Vec3(0.031, 0.031, kTwoToolsTopM + 0.001 - 0.04 * std::min(1.0, t / 0.4));
  };
  for (int ms = 1; ms <= 600; ++ms) {
    REQUIRE(bench.advance(1e-3 * ms, tool).converged);
    if (ms > 50) REQUIRE(bench.ports[0].touching);
  }
}

TEST_CASE("Two rigid tools press one another's tissue without exploding, however near they are") {
  const double apart_m = GENERATE(0.0, 0.002, 0.008, 0.020);
  const double softness = GENERATE(0.0, 1e-3);
  TwoToolsBench bench(2, {softness > 0 ? 1 / softness : 0, 0.3});
  const auto tool = [&](std::size_t k, double t) {
    const double depth = 0.006 * std::min(1.0, t / 0.1) + (k == 0 ? 0.002 * std::sin(20 * t) : -0.002 * std::sin(31 * t));
    return Vec3(0.029 + static_cast<double>(k) * apart_m, 0.031, kTwoToolsTopM + 0.001 - depth);
  };
  double most_n = 0;
  for (int k = 1; k <= 40; ++k) {
    REQUIRE(bench.advance(0.020 * k, tool).converged);
    for (const ToolPort& p : bench.ports) most_n = std::max(most_n, p.lambda.norm());
  }
  CHECK(most_n < 20);
  CHECK(bench.strain() < 0.03);
}

TEST_CASE("Four tools flung about at random leave a body that comes to rest again") {
  const double coupling = GENERATE(1000.0, 0.0);
  TwoToolsBench bench(4, {coupling, 0.3});
  Random random(7);
  std::array<Vec3, 4> from, to;
  for (std::size_t k = 0; k < 4; ++k) from[k] = to[k] = Vec3(0.03, 0.03, 0.1);
  double begin_s = 0;
  const auto tool = [&](std::size_t k, double t) {
    return Vec3(from[k] + std::min(1.0, (t - begin_s) / 0.1) * (to[k] - from[k]));
  };
  for (int leg = 0; leg < 30; ++leg) {
    for (std::size_t k = 0; k < 4; ++k) {
      from[k] = to[k];
      to[k] = Vec3(0.03, 0.03, 0.05) + random_vector(random, 0.06);
    }
    begin_s = 0.1 * leg;
    bench.advance(begin_s + 0.1, tool);
    bench.state.time_s = begin_s + 0.1;
    INFO("coupling " << coupling << ", leg " << leg);
    REQUIRE(bench.state.x.allFinite());
    REQUIRE(bench.strain() < 0.3);
  }
  for (std::size_t k = 0; k < 4; ++k) from[k] = to[k] = Vec3(0.03, 0.03, 0.2);
  begin_s = 3;
  REQUIRE(bench.advance(10, tool).converged);
  for (const ToolPort& p : bench.ports) CHECK_FALSE(p.touching);
}
