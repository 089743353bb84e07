// Stabilised explicit steps against the closed form of one mode, and against TR-BDF2 at a step at which that has converged.

#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"
#include "server/dynamics/integrator_selection.hpp"
#include "tests/support/explicit_steppers.hpp"
#include "tests/support/tool_bench.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kStabilisedTopM = 3 * kSpacingM;

/// b / k = 10 ms
LumpedBody damped_box() { return box_body(4, 4, 4, 60, 0.6); }

}  // namespace

TEST_CASE("A mass on a damped spring swings as its closed form says, to second order") {
  LumpedBody body;
  body.nodes = {Vec3(0, 0, 0), Vec3(0.1, 0, 0)};
  body.masses_kg = {0.01, 0.01};
  body.fixed = {1, 0};
  body.elements = {{0, 1, 0.1, 36, 0.18}};
  const Dynamics dynamics(body);
  const double w2 = 36 / 0.01, half_g = 0.5 * 0.18 / 0.01, swing = std::sqrt(w2 - half_g * half_g);
  constexpr double kFarM = 0.01, kUntilS = 0.2;
  const double exact_m =
      kFarM * std::exp(-half_g * kUntilS) * (std::cos(swing * kUntilS) + half_g / swing * std::sin(swing * kUntilS));
  Stabilised stabilised(dynamics, Skin());
  const auto off = [&](double step_s) {
    BodyState state = dynamics.rest_state();
    state.x[3] += kFarM;
    std::vector<ToolPort> ports;
    REQUIRE(stabilised.advance(state, ports, kUntilS, step_s, {}).steps == static_cast<int>(std::lround(kUntilS / step_s)));
    return std::abs(state.x[3] - 0.1 - exact_m) / kFarM;
  };
  CHECK(off(0.002) < 0.01);
  CHECK(off(0.004) / off(0.002) == Approx(4).epsilon(0.1));
}

TEST_CASE("A polynomial of s stages grows as the exponential to second order, and is bounded as far as 0.65 (s^2 - 1)") {
  for (const int s : {2, 3, 5, 10, 24}) {
    const Chebyshev method(s);
    CAPTURE(s);
    CHECK(method.stages.back().c == Approx(1).epsilon(1e-12));
    const auto off = [&](double z) { return std::abs(method.grow(z) - std::exp(z)); };
    CHECK(off(0.01) < 1e-6);
    CHECK(off(0.02) / off(0.01) == Approx(8).epsilon(0.03));
    for (double z = 0.001; z < 0.65 * (s * s - 1); z += 0.001 * s) CHECK(std::abs(method.grow(-z)) <= 1);
  }
}

TEST_CASE("What is stable at a step is stable at every shorter one, over the whole spectrum of the body") {
  const Spectrum spectrum{.w2 = 3e6, .g = 12'000, .least_s = 0.004, .most_s = 0.006};
  for (const int s : {3, 6, 9, 13}) {
    const Chebyshev method(s);
    double longest_s = 0.010;
    while (!method.is_stable(spectrum, longest_s)) longest_s *= 0.95;
    CHECK(longest_s * spectrum.g > 0.5 * s * s);
    for (double h = longest_s; h > 1e-5; h *= 0.93) CHECK(method.is_stable(spectrum, h));
  }
}

TEST_CASE("A body without dampers has no stable step, one with strong ones a third of the evaluations of leapfrog") {
  const LumpedBody undamped = box_body(4, 4, 4, 60, 0), damped = box_body(6, 6, 6, 240, 4.8);
  const Dynamics none(undamped), strong(damped);
  CHECK(Stabilised(none, Skin()).plan(0.010, ContactKind::attach).stages == 0);
  const ExplicitIntegrator::Plan plan = Stabilised(strong, Skin()).plan(0.010, ContactKind::attach);
  REQUIRE(plan.stages > 0);
  CHECK(plan.stages / plan.h < 1 / (3 * Leapfrog(strong, Skin()).plan(1, ContactKind::touch).h));
}

TEST_CASE("A damped body held by a tool is moved as by an implicit integrator that has converged") {
  ToolBench bench(damped_box());
  Stabilised stabilised(bench.dynamics, bench.skin);
  const Vec3 home = bench.body.nodes[bench.port.node];
  const auto way = [&](double t) { return Vec3(home + Vec3(0.004 * std::sin(12 * t), 0.003 * (1 - std::cos(9 * t)), 0)); };
  const auto truth = bench.felt(bench.fine, 0.0005, 0.5, way);
  CHECK(ToolBench::apart(bench.felt(stabilised, 0.010, 0.5, way), truth) < 0.005);
}

TEST_CASE("A planar body stays in its plane, and its damped springs may stiffen") {
  LumpedBody sheet = box_body(6, 6, 1, 60, 0.6);
  for (std::size_t i = 0; i < sheet.nodes.size(); ++i) sheet.fixed[i] = i < 6;
  sheet.planar = true;
  sheet.gravity_m_s2 = Vec3(0, -2, 0);
  sheet.law = SpringLaw::stiffening;
  sheet.stiffening = 20;
  ToolBench bench(sheet);
  Stabilised stabilised(bench.dynamics, bench.skin);
  const Vec3 home = bench.body.nodes[bench.port.node];
  const auto way = [&](double t) { return Vec3(home + Vec3(0.01 * std::sin(12 * t), 0.02 * (1 - std::cos(9 * t)), 0.003)); };
  const auto felt = bench.felt(stabilised, 0.010, 0.3, way);
  CHECK(ToolBench::apart(felt, bench.felt(bench.fine, 0.0005, 0.3, way)) < 0.005);
  for (const Vec3& force : felt) CHECK(force.z() == 0);
}

TEST_CASE("A tool that presses, strokes and lets go of a damped body feels what it feels with an implicit integrator") {
  ToolBench bench(damped_box(), ContactKind::touch);
  Stabilised stabilised(bench.dynamics, bench.skin);
  const auto way = [](double t) {
    const double in_m = 0.005 * std::min({1.0, t / 0.1, std::max(0.0, (0.45 - t) / 0.05)});
    return Vec3(0.02 + 0.05 * std::max(0.0, t - 0.15), 0.031, kStabilisedTopM + 0.001 - in_m);
  };
  const auto truth = bench.felt(bench.fine, 0.0005, 0.6, way);
  const auto felt = bench.felt(stabilised, 0.010, 0.6, way);
  REQUIRE(truth[30].norm() > 0.3);
  CHECK(ToolBench::apart(felt, truth) < 0.01);
  CHECK(felt.back() == Vec3::Zero());
}

TEST_CASE("Tools held still in a damped body come to the forces of its static balance, beside each other or one alone") {
  for (const std::size_t tools : {1, 2}) {
    const LumpedBody body = damped_box();
    const Dynamics dynamics(body);
    const Skin skin(body, 1.5 * kSpacingM);
    Stabilised stabilised(dynamics, skin);
    Integrator implicit(dynamics, skin, {0.010, 1e-11});
    const auto tool = [](std::size_t k, double t) {
      return ToolAt{Vec3(0.02 + 0.013 * static_cast<double>(k), 0.031, kStabilisedTopM - 0.004 * std::min(1.0, t / 0.1)),
                    Vec3::Zero()};
    };
    const auto held = [&](Stepper& stepper) {
      BodyState state = dynamics.rest_state();
      std::vector<ToolPort> ports(tools);
      for (ToolPort& port : ports) port.parameters = {800, 0.3};
      REQUIRE(stepper.advance(state, ports, 1.5, 0.010, tool).converged);
      return ports;
    };
    const auto felt = held(stabilised), truth = held(implicit);
    for (std::size_t k = 0; k < tools; ++k) {
      REQUIRE(truth[k].lambda.norm() > 0.1);
      CHECK((felt[k].lambda - truth[k].lambda).norm() < 0.002 * truth[k].lambda.norm());
    }
  }
}

TEST_CASE("A damped body that is let go loses energy in every frame, whatever state it is in") {
  const LumpedBody body = damped_box();
  const Dynamics dynamics(body);
  Stabilised stabilised(dynamics, Skin());
  BodyState state = random_state(dynamics, 3, 0.003, 0.3);
  std::vector<ToolPort> ports;
  double before_j = dynamics.energy(state);
  const double begin_j = before_j;
  for (int k = 1; k <= 40; ++k) {
    REQUIRE(stabilised.advance(state, ports, 0.050 * k, 0.010, {}).cut_steps == 0);
    CHECK(dynamics.energy(state) <= before_j + 1e-9 * begin_j);
    before_j = dynamics.energy(state);
  }
  CHECK(before_j < 1e-6 * begin_j);
}

TEST_CASE("What a frame comes to does not depend on the frames that an integrator stepped before") {
  ToolBench bench(damped_box(), ContactKind::touch);
  const auto way = [](double t) { return Vec3(0.02, 0.031, kStabilisedTopM - 0.005 * std::min(1.0, t / 0.1)); };
  Stabilised used(bench.dynamics, bench.skin), fresh(bench.dynamics, bench.skin);
  REQUIRE(used.is_stateless());
  bench.felt(used, 0.010, 0.2, [](double t) { return Vec3(0.04 - 0.1 * t, 0.02, kStabilisedTopM - 0.003); });
  CHECK(bench.felt(used, 0.010, 0.2, way) == bench.felt(fresh, 0.010, 0.2, way));
}

TEST_CASE("A damped body gets stabilised steps where leapfrog costs much, elsewhere it is said why not") {
  const auto reason = [](const LumpedBody& body, IntegratorKind integrator) {
    Scene scene;
    scene.body = body;
    scene.tool.contact = ContactKind::attach;
    scene.solver.integrator = integrator;
    const Dynamics dynamics(scene.body);
    return choose_stepper(scene, dynamics, Skin()).reason;
  };
  const LumpedBody damped = box_body(14, 14, 14, 60, 2.4), lively = box_body(14, 14, 14, 60, 0.01);
  CHECK(reason(damped, IntegratorKind::automatic).starts_with("stabilised"));
  CHECK(reason(damped, IntegratorKind::leapfrog).starts_with("explicit"));
  CHECK(reason(lively, IntegratorKind::automatic).starts_with("explicit"));
  CHECK_THROWS_AS(reason(box_body(4, 4, 4, 60, 0), IntegratorKind::stabilised), InputError);
  const std::string dear = reason(box_body(20, 20, 20, 600, 12), IntegratorKind::leapfrog);  // several cores
  CHECK(std::stod(dear.substr(dear.find("about ") + 6)) > 100);
  CHECK(dear.find("e+") == std::string::npos);
}

TEST_CASE("Finite elements are stepped as finely as a tenth of a core allows, between 2.5 ms and what the scene says") {
  const auto chosen = [](int nodes, double step_s, IntegratorKind integrator) {
    Scene scene;
    scene.body = solid_box(nodes, nodes, nodes, {});
    scene.solver.step_s = step_s;
    scene.solver.integrator = integrator;
    const Dynamics dynamics(scene.body);
    const ChosenStepper stepper = choose_stepper(scene, dynamics, Skin());
    return std::pair{stepper.step_s, stepper.cost};
  };
  CHECK(chosen(4, 0.010, IntegratorKind::automatic).first == 0.0025);
  CHECK(chosen(4, 0.001, IntegratorKind::automatic).first == 0.001);
  CHECK(chosen(4, 0.010, IntegratorKind::tr_bdf2).first == 0.010);
  const auto [between_s, cost] = chosen(8, 0.010, IntegratorKind::automatic);
  CHECK(between_s > 0.0025);
  CHECK(between_s < 0.010);
  CHECK(cost == Approx(0.1));
  CHECK(chosen(14, 0.010, IntegratorKind::automatic).first == 0.010);
}
