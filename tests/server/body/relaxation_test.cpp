// Relaxation of stress against the hereditary integral, finite differences, and elastic bodies with the long-term modulus.
#include "server/body/relaxation.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <numbers>

#include "server/body/settle.hpp"
#include "server/body/stillness.hpp"
#include "server/body/tangents.hpp"
#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/eigenvalues.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

const SolidMaterial kFast{SolidLaw::neo_hookean, 8e3, 0.45, 0};
const std::vector<PronyBranch> kBranches{{0.3, 0.05}, {0.25, 1.5}};

/// Box of crooked elements: nodes are moved a little.
LumpedBody fading_box(bool hexa, int n, const SolidMaterial& material = kFast) {
  LumpedBody body = hexa ? hexa_box(n, n, n, material) : solid_box(n, n, n, material);
  Random random(12);
  for (Vec3& x : body.nodes) x += random_vector(random, 0.1 * kSpacingM);
  body.relaxation = kBranches;
  return body;
}

double g(double t) {
  double left = 1;
  for (const PronyBranch& b : kBranches) left -= b.share * (1 - std::exp(-t / b.time_s));
  return left;
}

Vector forces_of(const Dynamics& dynamics, const BodyState& state) {
  Vector f;
  dynamics.forces(state, f);
  return f;
}

/// A state whose history does not match its position.
BodyState remembering(const Dynamics& dynamics, std::uint64_t seed) {
  BodyState state = random_state(dynamics, seed, 0.15 * kSpacingM, 0);
  dynamics.relaxation().relax(0.1, state);
  const BodyState other = random_state(dynamics, seed + 1, 0.1 * kSpacingM, 0.05);
  state.x = other.x;
  state.v = other.v;
  return state;
}

}  // namespace

TEST_CASE("After a step of strain the forces of a solid fade as its Prony series says, bent or inside out",
          "[body][relaxation]") {
  for (const bool hexa : {false, true}) {
    const LumpedBody body = fading_box(hexa, 3);
    const Dynamics dynamics(body);
    BodyState state = random_state(dynamics, 3, 0.2 * kSpacingM, 0);
    state.v.setZero();
    const Vector at_once = forces_of(dynamics, state);
    double t = 0;
    for (const double h : {0.01, 0.04, 0.2, 3.0}) {
      dynamics.relaxation().relax(h, state);
      t += h;
      CHECK((forces_of(dynamics, state) - g(t) * at_once).norm() < 1e-11 * at_once.norm());
      for (const std::uint32_t node : {0U, 13U, 26U})
        CHECK((dynamics.element_force(state, node) - node_of(forces_of(dynamics, state), node)).norm() < 1e-11 * at_once.norm());
    }
    dynamics.relaxation().relax_fully(state);
    CHECK((forces_of(dynamics, state) - dynamics.relaxation().left() * at_once).norm() < 1e-11 * at_once.norm());
    state.x = -state.x;  // inside out
    for (const double much : {1e-3, 1.0, 1e3}) dynamics.relaxation().relax(much, state);
    CHECK(forces_of(dynamics, state).allFinite());
  }
}

TEST_CASE("What fades and what it adds to stiffness are the gradient and curvature of one potential", "[body][relaxation]") {
  for (const bool hexa : {false, true}) {
    const LumpedBody body = fading_box(hexa, 3);
    const Dynamics dynamics(body);
    const BodyState s = remembering(dynamics, 5);
    const Vector direction = random_state(dynamics, 8, 1, 0).x, f = forces_of(dynamics, s);
    const double h = 1e-7;
    const auto moved = [&](double way) {
      BodyState there = s;
      there.x += way * direction;
      return there;
    };
    const double slope = (dynamics.energy(moved(h)) - dynamics.energy(moved(-h))) / (2 * h);
    CHECK(slope == Approx(-f.dot(direction)).epsilon(1e-6));
    const Vector change = (forces_of(dynamics, moved(h)) - forces_of(dynamics, moved(-h))) / (2 * h);
    Vector k_y, d_y;
    dynamics.multiply_tangents(s, direction, k_y, d_y);
    CHECK((k_y + change).norm() < 1e-6 * change.norm());

    const std::vector<std::uint8_t> none(dynamics.nodes(), 0);
    BlockMatrix a = dynamics.make_matrix();
    dynamics.assemble(s, 0, 0, 0.7, none, false, a);
    Vector product;
    a.multiply(direction, product);
    CHECK((product - 0.7 * k_y).norm() < 1e-10 * product.norm());
    Tangents tangents(dynamics);
    tangents.take(s);
    Matrix y(s.x.size(), 2), k_of, d_of, sum;
    y << direction, s.v;
    tangents.multiply(y, k_of, d_of);
    CHECK((k_of.col(0) - k_y).norm() < 1e-12 * k_y.norm());
    tangents.multiply_sum(y, 0.7, 0, sum);
    CHECK((sum - 0.7 * k_of).norm() < 1e-12 * sum.norm());
    dynamics.assemble(s, 0, 0, 1, none, true, a);
    const Matrix clamped = dense(s.x.size(), [&](const Vector& x) { return a.multiply(x, product), product; });
    CHECK(test::symmetric_eigenvalues(clamped)[0] > -1e-9 * clamped.norm());
  }
}

TEST_CASE("What a solid remembers turns with it", "[body][relaxation]") {
  const Mat3 turn = Eigen::AngleAxisd(1.2, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  for (const bool hexa : {false, true}) {
    const LumpedBody body = fading_box(hexa, 3);
    const Dynamics dynamics(body);
    BodyState s = remembering(dynamics, 15), turned = s;
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) at_node(turned.x, i) = turn * at_node(s.x, i);
    dynamics.relaxation().relax(0.3, s);
    dynamics.relaxation().relax(0.3, turned);
    s.v.setZero(), turned.v.setZero();
    const Vector f = forces_of(dynamics, s), f_turned = forces_of(dynamics, turned);
    double off = 0;
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
      off = std::max(off, (node_of(f_turned, i) - turn * node_of(f, i)).norm());
    CHECK(off < 1e-11 * f.norm());
  }
}

TEST_CASE("Of a small sinusoidal strain a solid gives back what the complex modulus of its Prony series says",
          "[body][relaxation]") {
  // sigma / (E_fast epsilon) = 1 - sum g_k / (1 + i omega tau_k)
  for (const bool hexa : {false, true}) {
    const LumpedBody body = fading_box(hexa, 2);
    const Dynamics dynamics(body);
    const BodyState rest = dynamics.rest_state();
    const Vector shape = random_state(dynamics, 4, 1e-6, 0).x - rest.x;
    Vector k_y, d_y;
    dynamics.multiply_tangents(rest, shape, k_y, d_y);
    for (const double omega : {0.5, 4.0, 40.0}) {
      std::complex<double> expected = 1;
      for (const PronyBranch& b : kBranches) expected -= b.share / std::complex<double>(1, omega * b.time_s);
      constexpr int kSteps = 400, kCycles = 12;  // steps per cycle; cycles until the start has no effect
      const int cycles = kCycles + static_cast<int>(omega);
      BodyState state = rest;
      std::complex<double> measured = 0;
      const double h = 2 * std::numbers::pi / omega / kSteps;
      for (int step = 0; step < cycles * kSteps; ++step) {  // Strang splitting as in the integrator: half, x, half
        dynamics.relaxation().relax(h / 2, state);
        const double phase = omega * h * (step + 1);
        state.x = rest.x + std::sin(phase) * shape;
        dynamics.relaxation().relax(h / 2, state);
        if (step < (cycles - 1) * kSteps) continue;
        measured += std::complex<double>(std::sin(phase), std::cos(phase)) * -forces_of(dynamics, state).dot(shape) /
                    k_y.dot(shape) * (2.0 / kSteps);
      }
      CHECK(measured.real() == Approx(expected.real()).epsilon(2e-4));
      CHECK(measured.imag() == Approx(expected.imag()).epsilon(2e-3));
    }
  }
}

TEST_CASE("Steps of a body whose stress fades are of second order", "[body][relaxation]") {
  LumpedBody body = fading_box(true, 3, {SolidLaw::neo_hookean, 8e3, 0.4, 0.02});
  body.gravity_m_s2 = {0, 0, -30};
  const Dynamics dynamics(body);
  const auto end = [&](double step_s) {
    BodyState state = dynamics.rest_state();
    Integrator integrator(dynamics, Skin(), {step_s, 1e-12});
    std::vector<ToolPort> none;
    REQUIRE(integrator.advance(state, none, 0.16, {}).converged);
    return state.x;
  };
  const Vector fine = end(0.00025), at_4 = end(0.004), at_2 = end(0.002);
  const double order = std::log2((at_4 - fine).norm() / (at_2 - fine).norm());
  CHECK(order > 1.8);
  CHECK(order < 2.6);
}

TEST_CASE("A body whose stress fades settles where an elastic one of what is left does, and creeps there by itself",
          "[body][relaxation]") {
  for (const bool hexa : {false, true}) {
    LumpedBody body = fading_box(hexa, 3, {SolidLaw::neo_hookean, 8e3, 0.4, 0.02});
    body.gravity_m_s2 = {0, 0, -9.81};
    LumpedBody slow = body;
    slow.relaxation.clear();
    slow.materials[0].young_pa *= 1 - 0.3 - 0.25;
    const Dynamics dynamics(body), of_slow(slow);
    const BodyState hangs = settled_state(dynamics, "hanging");
    CHECK((hangs.x - settled_state(of_slow, "hanging").x).norm() < 1e-9 * hangs.x.norm());
    CHECK(forces_of(dynamics, hangs).norm() - forces_of(of_slow, settled_state(of_slow, "hanging")).norm() < 1e-6);
    BodyState state = dynamics.rest_state();
    const double way = (hangs.x - state.x).norm();
    Integrator integrator(dynamics, Skin(), {0.01});
    std::vector<ToolPort> none;
    REQUIRE(integrator.advance(state, none, 1.0, {}).converged);
    const double after_1 = (state.x - hangs.x).norm() / way;
    REQUIRE(integrator.advance(state, none, 25.0, {}).converged);
    CHECK(after_1 > 0.05);  // it creeps
    CHECK((state.x - hangs.x).norm() < 1e-4 * way);
  }
}

TEST_CASE("A body that hangs still is not at rest before its stress has faded", "[body][relaxation]") {
  LumpedBody body = fading_box(true, 3);
  body.gravity_m_s2 = {0, 0, -9.81};
  LumpedBody fast = body;
  fast.relaxation.clear();
  const Dynamics dynamics(body), elastic(fast);
  const BodyState sunk = settled_state(dynamics, "hanging"), at_once = settled_state(elastic, "hanging");
  Stillness stillness(dynamics, 100, sunk.x), of_elastic(elastic, 100, at_once.x);
  CHECK(of_elastic.holds(at_once));
  CHECK(stillness.holds(sunk));
  CHECK_FALSE(stillness.holds(at_once));
}
