// A block on a rigid table: weight, friction angle, energy and impact, in every integrator; tangents against differences.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>

#include "server/body/settle.hpp"
#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/explicit_steppers.hpp"
#include "tests/support/pressed_body.hpp"
#include "tests/support/rigid_parts.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kG = 9.81, kMu = 0.5;

/// A free block of hexahedra on a table whose top is z = 0, under a gravity that is tilted about y.
LumpedBody block_on_table(double tilt_rad, double above_m = 0, double friction = kMu) {
  LumpedBody body = hexa_box(4, 4, 3, {.young_pa = 20e3, .poisson = 0.3, .damping_s = 0.004});
  for (Vec3& x : body.nodes) x.z() += above_m;
  body.fixed.assign(body.nodes.size(), 0);
  body.gravity_m_s2 = kG * Vec3(std::sin(tilt_rad), 0, -std::cos(tilt_rad));
  body.parts = {rigid_box(Vec3(-0.3, -0.3, -0.05), Vec3(1.2, 0.36, 0), friction)};
  return body;
}

struct Bench {
  explicit Bench(LumpedBody b, int kind) : body(std::move(b)) {
    if (kind == 0) stepper = std::make_unique<Integrator>(dynamics, skin, IntegratorOptions{0.005});
    if (kind == 1) stepper = std::make_unique<Leapfrog>(dynamics, skin);
    if (kind == 2) stepper = std::make_unique<Stabilised>(dynamics, skin);
  }
  AdvanceReport advance(double until_s) { return stepper->advance(state, ports, until_s, 0.005, {}); }
  Vec3 mean(const Vector& y) const {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) sum += body.masses_kg[i] * node_of(y, i);
    return sum / mass_kg();
  }
  double mass_kg() const { return dynamics.masses().sum() / 3; }
  Vec3 contact_force() const {
    Vector f = Vector::Zero(state.x.size());
    dynamics.contacts().add_forces(state, f);
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) sum += node_of(f, i);
    return sum;
  }

  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  std::unique_ptr<Stepper> stepper;
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports;
};

}  // namespace

TEST_CASE("A block on a table is borne by its weight, and stays where it is") {
  const int kind = GENERATE(0, 1, 2);
  CAPTURE(kind);
  Bench bench(block_on_table(0), kind);
  REQUIRE(bench.advance(1.5).converged);
  const double weight_n = bench.mass_kg() * kG;
  CHECK(bench.contact_force().z() == Approx(weight_n).epsilon(1e-3));
  CHECK(bench.contact_force().head<2>().norm() < 1e-3 * weight_n);
  CHECK(bench.state.v.cwiseAbs().maxCoeff() < 1e-4);
  CHECK(std::abs(bench.mean(bench.state.x).x() - 0.03) < 1e-4);
}

TEST_CASE("A block sticks below the friction angle, and slides beyond it with g (sin - mu cos)") {
  const int kind = GENERATE(0, 1, 2);
  CAPTURE(kind);
  const double angle = std::atan(kMu);
  {
    Bench bench(block_on_table(angle - 2 * std::numbers::pi / 180), kind);
    REQUIRE(bench.advance(1).converged);
    const double before = bench.mean(bench.state.x).x();
    REQUIRE(bench.advance(2).converged);
    CHECK(std::abs(bench.mean(bench.state.x).x() - before) < 1e-5);
    CHECK(bench.mean(bench.state.v).norm() < 1e-5);
  }
  const double tilt = angle + 4 * std::numbers::pi / 180;
  Bench bench(block_on_table(tilt), kind);
  REQUIRE(bench.advance(0.6).converged);
  const double before = bench.mean(bench.state.v).x();
  REQUIRE(bench.advance(1.2).converged);
  const double expected = kG * (std::sin(tilt) - kMu * std::cos(tilt));
  CHECK((bench.mean(bench.state.v).x() - before) / 0.6 == Approx(expected).epsilon(0.02));
}

TEST_CASE("A block that falls onto a table meets it without a step of force, and never gains energy") {
  const int kind = GENERATE(0, 1, 2);
  const double tilt = GENERATE(0.0, 0.3);
  CAPTURE(kind, tilt);
  constexpr double kFallM = 0.01, kTickS = 0.0005;
  Bench bench(block_on_table(tilt, kFallM), kind);
  const double speed = std::sqrt(2 * kG * kFallM), fallen_j = bench.mass_kg() * kG * kFallM;
  // What springs and dampers of all nodes below change by at this speed, with twice the stiffness of a compressed body.
  double stiffness = 0;
  const Bench pressed(block_on_table(0, -1e-4), 0);
  for (const Contacts::Block& block : pressed.dynamics.contacts().tangents(pressed.state)) stiffness += block.stiffness(2, 2);
  REQUIRE(stiffness > 0);
  const double onset_m = Contacts::kOnsetEdges * mean_edge_m(bench.body);
  const double most_n = 2 * stiffness * speed * kTickS * (1 + 0.004 * speed / onset_m);
  double before_n = 0, energy_j = bench.dynamics.energy(bench.state), largest_n = 0;
  const double gain = kind == 2 ? 0.02 : 1e-4;  // stages of a step do not know of a contact that begins in it
  bool met = false;
  for (double t = kTickS; t < 0.5; t += kTickS) {
    REQUIRE(bench.advance(t).converged);
    const double force_n = bench.contact_force().z();
    CHECK(force_n > -1e-9);
    CHECK(std::abs(force_n - before_n) < most_n);
    before_n = force_n;
    largest_n = std::max(largest_n, force_n);
    met |= force_n > 0;
    const double now_j = bench.dynamics.energy(bench.state);
    CHECK(now_j < energy_j + gain * fallen_j);
    energy_j = std::min(energy_j, now_j);
  }
  CHECK(met);
  CHECK(largest_n > 2 * bench.mass_kg() * kG);
}

TEST_CASE("Tangents of contacts that stick are differences of their forces, and add to those of the body") {
  LumpedBody body = block_on_table(0);
  const Dynamics dynamics(body);
  BodyState state = dynamics.rest_state();
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) state.x[3 * i + 2] -= 0.003;  // deeper than the onset of the damper
  dynamics.contacts().follow(state);
  Random random(3);
  for (Eigen::Index i = 0; i < state.x.size(); ++i)
    state.x[i] += random.uniform(-5e-4, 5e-4), state.v[i] = random.uniform(-1e-3, 1e-3);
  LumpedBody alone = body;
  alone.parts.clear();
  const Dynamics without(alone);
  const Matrix k = dense_stiffness(dynamics, state) - dense_stiffness(without, state),
               d = dense_damping(dynamics, state) - dense_damping(without, state);
  const auto forces = [&](const BodyState& s) {
    Vector f = Vector::Zero(s.x.size());
    dynamics.contacts().add_forces(s, f);
    return f;
  };
  constexpr double kStepM = 1e-7, kStepMS = 1e-5;
  REQUIRE(k.norm() > 100);
  for (Eigen::Index c = 0; c < state.x.size(); ++c) {
    BodyState up = state, down = state;
    up.x[c] += kStepM, down.x[c] -= kStepM;
    CHECK((k.col(c) - (forces(down) - forces(up)) / (2 * kStepM)).norm() < 1e-3 * k.norm());
    up = down = state;
    up.v[c] += kStepMS, down.v[c] -= kStepMS;
    CHECK((d.col(c) - (forces(down) - forces(up)) / (2 * kStepMS)).norm() < 1e-3 * d.norm());
  }
}

TEST_CASE("A body far from a part is stepped to the bits of one without") {
  LumpedBody with = block_on_table(0, 0.2), without = with;
  without.parts.clear();
  Bench bench(with, 0), alone(without, 0);
  for (Bench* b : {&bench, &alone}) b->state.v[5] = 0.1, b->advance(0.05);
  CHECK(bench.state.x == alone.state.x);
  CHECK_FALSE(bench.state.anchors);
}

TEST_CASE("A body pressed onto a table yields by the tangents that a patch is made of") {
  const test::Yield yield = test::yield_of(block_on_table(0, 0, 2), Vec3(0.03, 0.03, 0.04));  // rough: nothing slips
  CHECK(yield.by_force == Approx(yield.by_tangents).epsilon(0.02));
}
