// Unilateral contact in the integrator against series compliance, the friction cone and the moment of contact.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/motion/motion.hpp"
#include "server/dynamics/integrator_selection.hpp"
#include "server/scene/scene.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// A square plate of two triangles at z = 0, each corner hung on a spring from a fixed node above: stable under a push from
/// above.
LumpedBody hung_plate(double stiffness_n_m, double damping_n_s_m) {
  LumpedBody body;
  for (const double z : {0.0, 0.1})
    for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(0.1, 0, 0), Vec3(0.1, 0.1, 0), Vec3(0, 0.1, 0)}) {
      body.nodes.push_back(corner + Vec3(0, 0, z));
      body.masses_kg.push_back(0.01);
      body.fixed.push_back(z > 0);
    }
  for (std::uint32_t i = 0; i < 4; ++i) body.elements.push_back({i, i + 4, 0.1, stiffness_n_m, damping_n_s_m});
  body.triangles = {{0, 1, 2}, {0, 2, 3}};
  return body;
}

struct TouchBench {
  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  Integrator integrator;
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports{1};

  TouchBench(LumpedBody b, ContactParameters parameters, double step_s = 0.010, std::uint8_t all_fixed = 0)
      : body(std::move(b)), integrator(dynamics, skin, {step_s, 1e-11}) {
    if (all_fixed) body.fixed.assign(body.nodes.size(), 1);
    ports[0].parameters = parameters;
  }
  AdvanceReport advance(double until_s, const std::function<Vec3(double)>& tool) {
    return integrator.advance(state, ports, until_s, [&](std::size_t, double t) { return ToolAt{tool(t), Vec3::Zero()}; });
  }
  Vec3 normal() const {
    return normal_at(skin.view(), {state.x.data(), static_cast<std::size_t>(state.x.size())}, ports[0].point);
  }
};

}  // namespace

TEST_CASE("A resting push on a hung plate is the plate's springs in series with the contact") {
  const double coupling = GENERATE(500.0, 5000.0, 0.0);
  TouchBench bench(hung_plate(100, 5), {coupling, 0.0});
  // Above the middle. A stiff plate would share the load among all four corners; this one bends along its diagonal 0-2, which
  // carries the load alone.
  const Vec3 tool(0.05, 0.05, -0.006);
  REQUIRE(bench.advance(5, [&](double) { return tool; }).converged);
  const double contact_softness = coupling > 0 ? 1 / coupling : 0;
  CHECK(bench.ports[0].touching);
  CHECK(-bench.ports[0].lambda.z() == Approx(0.006 / (1.0 / 200 + contact_softness)).epsilon(1e-4));
  CHECK(bench.ports[0].lambda.head<2>().norm() < 1e-6);
}

TEST_CASE("On rigid ground the force is the contact's own stiffness, and a stroke slides on the friction cone") {
  TouchBench bench(hung_plate(100, 5), {800, 0.4}, 0.010, 1);
  REQUIRE(bench.advance(0.1, [](double) { return Vec3(0.03, 0.02, -0.005); }).converged);
  CHECK((bench.ports[0].lambda - Vec3(0, 0, -4)).norm() < 1e-9);
  int slipped = 0;
  for (int ms = 1; ms <= 300; ++ms) {
    const double before_x = bench.ports[0].point.weight[0];
    REQUIRE(bench.advance(0.1 + 1e-3 * ms, [](double t) { return Vec3(0.03 + 0.1 * (t - 0.1), 0.02, -0.005); }).converged);
    const Vec3 lambda = bench.ports[0].lambda;
    CHECK(-lambda.z() == Approx(4));
    CHECK(lambda.head<2>().norm() <= 0.4 * 4 * (1 + 1e-9));
    slipped += bench.ports[0].point.weight[0] != before_x;
  }
  // Stuck until k_c times the path is mu times the force (2 mm, 20 ms), then sliding, dragged along by the full cone.
  CHECK(slipped == Approx(280).margin(2));
  CHECK(bench.ports[0].lambda.x() == Approx(0.4 * 4));
}

TEST_CASE("The friction cone holds while a tool strokes a soft cube") {
  const double friction = GENERATE(0.0, 0.3);
  TouchBench bench(box_body(4, 4, 4), {1000, friction});
  double worst = 0;
  for (int ms = 1; ms <= 600; ++ms) {
    const auto tool = [](double t) { return Vec3(0.015 + 0.05 * t, 0.031, 0.06 - 0.006 * std::min(1.0, t / 0.1)); };
    REQUIRE(bench.advance(1e-3 * ms, tool).converged);
    const Vec3 lambda = bench.ports[0].lambda;
    if (!bench.ports[0].touching) continue;
    const Vec3 n = bench.normal();
    worst = std::max(worst, ((lambda - n * n.dot(lambda)).norm() + friction * n.dot(lambda)) / lambda.norm());
    CHECK(lambda.dot(n) < 0);
  }
  CHECK(bench.ports[0].touching);
  CHECK(worst < 0.001);
}

TEST_CASE("A tool that leaves lets go: no force, and the body swings back to rest") {
  TouchBench bench(box_body(4, 4, 4), {1000, 0.3});
  REQUIRE(bench.advance(0.3, [](double) { return Vec3(0.031, 0.031, 0.054); }).converged);
  CHECK(bench.ports[0].touching);
  CHECK(bench.ports[0].lambda.norm() > 0.1);
  REQUIRE(bench.advance(0.4, [](double) { return Vec3(0.031, 0.031, 0.1); }).converged);
  CHECK_FALSE(bench.ports[0].touching);
  CHECK(bench.ports[0].lambda.norm() == 0);
  REQUIRE(bench.advance(6, [](double) { return Vec3(0.031, 0.031, 0.1); }).converged);
  CHECK((bench.state.x - bench.dynamics.rest_state().x).cwiseAbs().maxCoeff() < 1e-6);
}

TEST_CASE("A step in which contact begins or ends is redone in short pieces") {
  TouchBench bench(box_body(4, 4, 4), {1000, 0.3});
  const auto tool = [](double t) { return Vec3(0.031, 0.031, t < 0.1 ? 0.062 - 0.2 * t : 0.062 - 0.02 + 0.2 * (t - 0.1)); };
  // The tool is at the surface after 10 ms.
  CHECK(bench.advance(0.005, tool).cut_steps == 0);
  CHECK_FALSE(bench.ports[0].touching);
  const AdvanceReport onset = bench.advance(0.015, tool);
  CHECK(onset.cut_steps >= 1);
  CHECK(onset.steps >= 3);
  CHECK(bench.ports[0].touching);
  bool released = false;
  int cuts = 0;
  for (int k = 1; k <= 30 && !released; ++k) {
    cuts = bench.advance(0.1 + 0.01 * k, tool).cut_steps;
    released = !bench.ports[0].touching;
  }
  CHECK(released);
  CHECK(cuts >= 1);
}

TEST_CASE("A thin plate that is pressed far and left fast lets the tool go and never pulls it") {
  // Pressed through itself: its upper side returns below its lower one, as fast as the tool.
  struct Way {
    const char* plate;
    double middle_m, deep_m;
  };
  const Way way = GENERATE(Way{R"({"nodes": [9, 9, 4], "size_m": [0.08, 0.08, 0.015])", 0.04, 0.035},
                           Way{R"({"nodes": [9, 9, 3], "size_m": [0.08, 0.08, 0.01])", 0.04, 0.030},
                           Way{R"({"nodes": [7, 7, 4], "size_m": [0.06, 0.06, 0.012])", 0.03, 0.030});
  const LumpedBody body = read_scene(std::string(R"({"body": {"lattice": )") + way.plate +
                                         R"(, "solid": {"material": "liver"}, "fixed_faces": ["x-", "x+"]}},
                                         "tool": {"contact": "touch", "radius_m": 0.01}})",
                                     "plate")
                              .body;
  const Dynamics dynamics(body);
  const Skin skin(body, 0.01);
  Integrator integrator(dynamics, skin, {});
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports(1);
  ports[0].parameters = {1000, 0.3};
  const Motion motion({{0, {way.middle_m, way.middle_m, 0.02}},
                       {0.5, {way.middle_m, way.middle_m, -way.deep_m}},
                       {0.6, {way.middle_m, way.middle_m, -way.deep_m}},
                       {0.6 + 2 * (0.02 + way.deep_m), {way.middle_m, way.middle_m, 0.02}},
                       {1.2, {way.middle_m, way.middle_m, 0.02}}});
  double most_pull_n = 0, most_push_n = 0;
  for (int k = 1; k <= 100; ++k) {
    const auto tool = [&](std::size_t, double t) { return ToolAt{motion.position(t), Vec3::Zero()}; };
    REQUIRE(integrator.advance(state, ports, 0.01 * k, 0.01, tool).converged);
    most_pull_n = std::max(most_pull_n, ports[0].lambda.z());
    most_push_n = std::max(most_push_n, -ports[0].lambda.z());
  }
  CAPTURE(way.plate);
  CHECK(most_push_n > 0.3);
  CHECK(most_pull_n == 0);
  CHECK_FALSE(ports[0].touching);
}

TEST_CASE(
    "A step that a tool would tear out of the world is given up before its numbers overflow, and the body stays as it was") {
  const LumpedBody body = solid_box(4, 4, 4, {SolidLaw::corotational, 2e4, 0.33, 0.003});
  const Dynamics dynamics(body);
  const Skin skin(body, 0.02);
  Integrator integrator(dynamics, skin, {.solver = LinearSolver::Method::conjugate_gradients});
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports(1);
  ports[0].parameters = {1000, 0.3};
  const double top_m = 3 * kSpacingM, far_m = GENERATE(1e20, 1e40, 1e80, 1e160);
  const auto tool_at = [](const Vec3& at) { return [at](std::size_t, double) { return ToolAt{at, Vec3::Zero()}; }; };
  REQUIRE(integrator.advance(state, ports, 0.05, tool_at({0.03, 0.03, top_m - 0.004})).converged);
  REQUIRE(ports[0].touching);
  const BodyState before = state;
  CHECK_FALSE(integrator.advance(state, ports, 0.06, tool_at({0.03, 0.03, top_m - far_m})).converged);
  CHECK(state.x == before.x);
  CHECK(state.v == before.v);
}

TEST_CASE(
    "A room's steps under a tool are as true as those solved a thousand times as well, for less than seven tenths of the work") {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/organ.json");
  const Dynamics dynamics(scene.body);
  const Skin skin(scene.body, scene.tool.radius_m);
  const ChosenStepper chosen = choose_stepper(scene, dynamics, skin);
  Integrator exact(dynamics, skin, {.step_s = chosen.step_s, .tolerance_m = 1e-9, .solve_tolerance = 1e-3});
  double top_m = 0;
  for (const Vec3& x : scene.body.nodes)
    if (x.head<2>().norm() < 0.01) top_m = std::max(top_m, x.z());
  const auto tool = [&](std::size_t, double t) {
    return ToolAt{Vec3(0.02 * std::max(0.0, t - 0.3), 0.003, top_m + 0.002 - 0.012 * std::min(1.0, t / 0.3)), Vec3::Zero()};
  };
  const auto press = [&](Stepper& stepper, int& iterations) {
    BodyState state = dynamics.rest_state();
    std::vector<ToolPort> ports(1);
    ports[0].parameters = {scene.tool.contact_stiffness_n_m, scene.tool.friction};
    std::vector<Vec3> forces;
    for (int frame = 1; frame <= 12; ++frame) {
      iterations += stepper.advance(state, ports, 0.05 * frame, chosen.step_s, tool).newton_iterations;
      forces.push_back(ports[0].lambda);
    }
    return forces;
  };
  int as_chosen = 0, exactly = 0;
  const std::vector<Vec3> room = press(*chosen.stepper, as_chosen), right = press(exact, exactly);
  for (std::size_t k = 0; k < room.size(); ++k) CHECK((room[k] - right[k]).norm() < 0.002 * right.back().norm());
  CHECK(right.back().norm() > 1);
  CHECK(as_chosen < 0.7 * exactly);
}
