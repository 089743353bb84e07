// Threads through a body: momentum, the pulley, tangents against differences, and a hand that pulls.
#include <catch2/catch.hpp>
#include <cmath>

#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/pressed_body.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

const SolidMaterial kMaterial{.young_pa = 20e3, .poisson = 0.3, .damping_s = 0.02};

std::uint32_t node_at(const LumpedBody& body, const Vec3& x) {
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i)
    if ((body.nodes[i] - x).norm() < 1e-9) return i;
  return 0;
}

/// Two blocks beside each other, 20 mm apart, that are one body of two pieces.
LumpedBody two_blocks(bool fixed) {
  LumpedBody body = hexa_box(4, 4, 3, kMaterial);
  LumpedBody other = body;
  const auto first = static_cast<std::uint32_t>(body.nodes.size());
  for (const Vec3& x : other.nodes) body.nodes.push_back(x + Vec3(0.08, 0, 0));
  body.masses_kg.insert(body.masses_kg.end(), other.masses_kg.begin(), other.masses_kg.end());
  body.fixed.assign(body.nodes.size(), 0);
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) body.fixed[i] = fixed && body.nodes[i].z() == 0;
  for (Hexahedron h : other.hexahedra) {
    for (std::uint32_t& node : h.nodes) node += first;
    body.hexahedra.push_back(h);
  }
  for (const Triangle& t : other.triangles) body.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return body;
}

/// A thread through nodes at rest places, in turn.
Suture thread(const LumpedBody& body, const std::vector<Vec3>& at, double friction, double slack_m = 0) {
  Suture suture;
  suture.law = {static_cast<int>(at.size()), 1000, friction, 0, true, false};
  for (std::size_t j = 0; j < at.size(); ++j) {
    suture.bites.push_back({.at = {{node_at(body, at[j]), 1.0}}, .rest = at[j]});
    if (j > 0) suture.length_m[j] = (at[j] - at[j - 1]).norm() + slack_m;
  }
  suture.length_m[at.size()] = 0.02;
  return suture;
}

struct Bench {
  explicit Bench(LumpedBody b) : body(std::move(b)) {}
  void advance(double until_s, const ToolMotion& hand = {}) {
    REQUIRE(stepper.advance(state, ports, until_s, 0.005, hand).converged);
  }
  SuturePull pull() const {
    return dynamics.sutures().pull_of(state, 0, shape_of(state.sutures->threads[0].law, dynamics.sutures().place_of(state, 0)));
  }

  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  Integrator stepper{dynamics, skin, {0.005, 1e-10}};
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports;
};

/// The hand holds the thread of the body.
void take_up(Bench& bench) {
  ToolPort port;
  port.suture = 0;
  port.bite = last_bite(bench.state, 0);
  port.touching = true;
  bench.ports = {port};
}

}  // namespace

TEST_CASE("A thread pushes and turns a body as a whole by nothing, and pulls two free blocks together with their momentum") {
  LumpedBody body = two_blocks(false);
  Suture suture = thread(body, {{0.06, 0, 0.04}, {0.08, 0.04, 0.02}, {0.06, 0.06, 0.04}, {0.08, 0.02, 0.04}}, 0.15);
  for (std::size_t i = 1; i < 4; ++i) suture.length_m[i] *= 0.9;
  suture.law.last_tied = true;
  body.sutures = {suture};
  Bench bench(body);
  Vector f = Vector::Zero(bench.state.x.size());
  bench.dynamics.sutures().add_forces(bench.state, f);
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  double size_n = 0;
  for (std::uint32_t i = 0; i < bench.dynamics.nodes(); ++i) {
    force += node_of(f, i);
    torque += node_of(bench.state.x, i).cross(node_of(f, i));
    size_n += node_of(f, i).norm();
  }
  REQUIRE(size_n > 1);
  CHECK(force.norm() < 1e-14 * size_n);
  CHECK(torque.norm() < 1e-14 * size_n);
  bench.advance(0.05);
  Vec3 momentum = Vec3::Zero();
  double speeds = 0;
  for (std::uint32_t i = 0; i < bench.dynamics.nodes(); ++i) {
    momentum += bench.body.masses_kg[i] * node_of(bench.state.v, i);
    speeds += bench.body.masses_kg[i] * node_of(bench.state.v, i).norm();
  }
  CHECK(momentum.norm() < 1e-6 * speeds);
  const auto gap_m = [&] {
    return node_of(bench.state.x, node_at(bench.body, {0.08, 0.04, 0.02})).x() -
           node_of(bench.state.x, node_at(bench.body, {0.06, 0, 0.04})).x();
  };
  CHECK(gap_m() < 0.0199);
}

TEST_CASE("A hand that pulls a thread around a bite pulls that bite with both its sides") {
  const double friction = GENERATE(0.0, 0.2);
  LumpedBody body = hexa_box(6, 4, 3, kMaterial);
  // From the knot at x = 0 to the bite at x = 80 mm, and back to the hand.
  body.sutures = {thread(body, {{0, 0.02, 0.04}, {0.08, 0.02, 0.04}}, friction)};
  Bench bench(body);
  take_up(bench);
  const Vec3 begin(0.06, 0.02, 0.04);
  const auto hand = [&](std::size_t, double t) { return ToolAt{begin - Vec3(std::min(0.01 * t, 0.004), 0, 0)}; };
  const auto total_m = [&] {
    const OfSpans& lengths = bench.state.sutures->threads[0].length_m;
    return lengths[0] + lengths[1] + lengths[2];
  };
  bench.advance(0.005, hand);
  const double taken_m = total_m();
  CHECK(taken_m == Approx(0.08 + 0.02).margin(1e-4));
  bench.advance(0.38, hand);
  const SuturePull pull = bench.pull();
  REQUIRE(pull.tension_n[2] > 0.02);
  CHECK(pull.tension_n[2] / pull.tension_n[1] == Approx(std::exp(friction * 3.14159265)).epsilon(0.01));
  CHECK((bench.ports[0].lambda - pull.tension_n[2] * Vec3(-1, 0, 0)).norm() < 0.05 * pull.tension_n[2]);
  Vector f = Vector::Zero(bench.state.x.size());
  bench.dynamics.sutures().add_forces(bench.state, f);
  const Vec3 on_bite = node_of(f, node_at(bench.body, {0.08, 0.02, 0.04}));
  CHECK(on_bite.norm() == Approx(pull.tension_n[1] + pull.tension_n[2]).epsilon(0.01));
  CHECK(total_m() == Approx(taken_m).epsilon(1e-14));
}

TEST_CASE("The tangents of a thread are the differences of its forces, where it sticks and where it slides without friction") {
  LumpedBody body = two_blocks(true);
  const bool sliding = GENERATE(false, true);
  Suture suture = thread(body, {{0.06, 0, 0.04}, {0.08, 0.04, 0.02}, {0.06, 0.06, 0.04}, {0.08, 0.02, 0.04}}, sliding ? 0 : 0.3);
  for (std::size_t i = 1; i < 4; ++i) suture.length_m[i] -= sliding ? 0.001 * static_cast<double>(i) : 0.001;
  suture.law.last_tied = true;
  body.sutures = {suture};
  Bench bench(body);
  const auto forces = [&](const BodyState& state) {
    Vector f = Vector::Zero(state.x.size());
    bench.dynamics.sutures().add_forces(state, f);
    return f;
  };
  Random random(3);
  Vector y = Vector::Zero(bench.state.x.size());
  for (const SutureBite& bite : suture.bites) at_node(y, bite.at[0].first) = random_vector(random, 1);
  Vector by_blocks = Vector::Zero(y.size());
  for (const Sutures::Block& block : bench.dynamics.sutures().tangents(bench.state)) {
    double moved = 0;
    for (const auto& [node, part] : block.y) moved += part.dot(node_of(y, node));
    for (const auto& [node, part] : block.y) at_node(by_blocks, node) += block.stiffness_n_m * moved * part;
  }
  constexpr double kStep = 1e-7;
  BodyState high = bench.state, low = bench.state;
  high.x += kStep * y;
  low.x -= kStep * y;
  const Vector differences = (forces(low) - forces(high)) / (2 * kStep);
  CHECK((by_blocks - differences).norm() < 1e-4 * differences.norm());
}

TEST_CASE("A body without threads has no state of them, and one whose thread is slack feels none") {
  LumpedBody body = hexa_box(4, 4, 3, kMaterial);
  CHECK(Bench(body).state.sutures == nullptr);
  body.sutures = {thread(body, {{0, 0, 0.04}, {0.06, 0.02, 0.04}}, 0.1, 0.01)};
  Bench bench(body);
  bench.advance(0.1);
  CHECK(bench.state.v.norm() < 1e-12);
  CHECK(bench.dynamics.sutures().energy(bench.state) == 0);
}
