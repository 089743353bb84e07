// Bodies in contact with each other and with themselves: momentum, Hertz's force, friction angle, tangents and patches'
// stiffness.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>

#include "server/body/settle.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/scene/members.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/explicit_steppers.hpp"
#include "tests/support/pressed_body.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kG = 9.81, kMu = 0.5;

LumpedBody block(int nx, int ny, int nz, const Vec3& at, bool is_fixed = false, bool of_tetrahedra = false) {
  const SolidMaterial material{.young_pa = 20e3, .poisson = 0.3, .damping_s = 0.004};
  LumpedBody body = of_tetrahedra ? solid_box(nx, ny, nz, material) : hexa_box(nx, ny, nz, material);
  for (Vec3& x : body.nodes) x += at;
  if (!is_fixed) body.fixed.assign(body.nodes.size(), 0);
  return body;
}

std::vector<Member> named(std::size_t n, double friction = kMu) {
  std::vector<Member> members(n);
  for (Member& member : members) member.friction = friction;
  return members;
}

/// A free block of 60 x 60 x 40 mm on one of 220 x 80 x 20 mm whose bottom is fixed.
LumpedBody block_on_block(double tilt_rad, double above_m = 0, bool of_tetrahedra = false) {
  LumpedBody body = joined({block(12, 5, 2, Vec3(-0.031, -0.012, -kSpacingM), true, of_tetrahedra),
                            block(4, 4, 3, Vec3(0, 0, above_m), false, of_tetrahedra)},
                           named(2));
  body.gravity_m_s2 = kG * Vec3(std::sin(tilt_rad), 0, -std::cos(tilt_rad));
  return body;
}

struct Bench {
  explicit Bench(LumpedBody b, int kind, IntegratorOptions options = {0.005}) : body(std::move(b)) {
    if (kind == 0) stepper = std::make_unique<Integrator>(dynamics, skin, options);
    if (kind == 1) stepper = std::make_unique<Leapfrog>(dynamics, skin);
    if (kind == 2) stepper = std::make_unique<Stabilised>(dynamics, skin);
  }
  AdvanceReport advance(double until_s) { return stepper->advance(state, ports, until_s, 0.005, {}); }
  double mass_kg(std::size_t m) const {
    double sum = 0;
    for (std::uint32_t i = body.members[m].first_node; i < body.members[m].end_node; ++i) sum += body.masses_kg[i];
    return sum;
  }
  Vec3 mean(std::size_t m, const Vector& y) const {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = body.members[m].first_node; i < body.members[m].end_node; ++i)
      sum += body.masses_kg[i] * node_of(y, i);
    return sum / mass_kg(m);
  }
  Vector contact_forces() const {
    Vector f = Vector::Zero(state.x.size());
    dynamics.contacts().add_forces(state, f);
    return f;
  }
  Vec3 force_on(std::size_t m) const {
    const Vector f = contact_forces();
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = body.members[m].first_node; i < body.members[m].end_node; ++i) sum += node_of(f, i);
    return sum;
  }
  Vec3 momentum() const {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) sum += body.masses_kg[i] * node_of(state.v, i);
    return sum;
  }

  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  std::unique_ptr<Stepper> stepper;
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports;
};

/// Sets the velocity of a member.
void move(Bench& bench, std::size_t m, const Vec3& velocity) {
  for (std::uint32_t i = bench.body.members[m].first_node; i < bench.body.members[m].end_node; ++i)
    at_node(bench.state.v, i) = velocity;
}

}  // namespace

TEST_CASE("Contacts between bodies push and turn the two as a whole by nothing, friction and dampers included") {
  const bool tetrahedra = GENERATE(false, true);
  Bench bench(
      joined({block(4, 4, 4, Vec3::Zero(), false, tetrahedra), block(3, 4, 3, Vec3(0.017, 0.011, 0.0585), false, tetrahedra)},
             named(2)),
      0);
  Random random(5);
  for (Eigen::Index i = 0; i < bench.state.x.size(); ++i)
    bench.state.x[i] += random.uniform(-2e-3, 2e-3), bench.state.v[i] = random.uniform(-0.05, 0.05);
  bench.dynamics.contacts().follow(bench.state);
  REQUIRE(bench.state.anchors);
  for (Eigen::Index i = 0; i < bench.state.x.size(); ++i) bench.state.x[i] += random.uniform(-3e-4, 3e-4);
  const Vector f = bench.contact_forces();
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  double size_n = 0, size_n_m = 0;
  for (std::uint32_t i = 0; i < bench.dynamics.nodes(); ++i) {
    force += node_of(f, i);
    torque += node_of(bench.state.x, i).cross(node_of(f, i));
    size_n += node_of(f, i).norm();
    size_n_m += node_of(bench.state.x, i).cross(node_of(f, i)).norm();
  }
  REQUIRE(size_n > 0.5);
  CHECK(force.norm() < 1e-14 * size_n);
  CHECK(torque.norm() < 1e-12 * size_n_m);
  CHECK(bench.force_on(0).norm() > 0.05 * size_n);
}

TEST_CASE("Two free bodies that collide keep their momentum to rounding, and part again") {
  Bench bench(joined({block(4, 4, 4, Vec3::Zero()), block(3, 3, 3, Vec3(0.012, 0.013, 0.0605))}, named(2)), 0, {0.005, 1e-14});
  move(bench, 1, Vec3(0.05, 0.02, -0.3));
  const Vec3 before = bench.momentum();
  double most_n = 0;
  for (double t = 0.005; t < 0.3; t += 0.005) {
    REQUIRE(bench.advance(t).converged);
    most_n = std::max(most_n, bench.force_on(1).z());
    CHECK((bench.momentum() - before).norm() < 1e-11 * before.norm());
  }
  CHECK(most_n > 0.1);
  CHECK(bench.force_on(1).norm() == 0);
  CHECK(bench.mean(1, bench.state.v).z() > bench.mean(0, bench.state.v).z());
}

TEST_CASE("A block on a block is borne by its weight, sticks below the friction angle, and slides beyond it") {
  const int kind = GENERATE(0, 1, 2);
  CAPTURE(kind);
  const double angle = std::atan(kMu);
  {
    Bench bench(block_on_block(angle - 2 * std::numbers::pi / 180), kind);
    REQUIRE(bench.advance(1).converged);
    const Vec3 before = bench.mean(1, bench.state.x);
    REQUIRE(bench.advance(2).converged);
    CHECK((bench.mean(1, bench.state.x) - before).norm() < 2e-5);
    CHECK((bench.force_on(1) + bench.mass_kg(1) * bench.body.gravity_m_s2).norm() < 1e-3 * bench.mass_kg(1) * kG);
  }
  const double tilt = angle + 4 * std::numbers::pi / 180;
  Bench bench(block_on_block(tilt), kind);
  REQUIRE(bench.advance(0.3).converged);
  const double before = bench.mean(1, bench.state.v).x();
  REQUIRE(bench.advance(0.5).converged);
  const double expected = kG * (std::sin(tilt) - kMu * std::cos(tilt));
  CHECK((bench.mean(1, bench.state.v).x() - before) / 0.2 == Approx(expected).epsilon(0.05));
}

TEST_CASE("A block that falls onto a block meets it without a step of force, and never gains energy") {
  const int kind = GENERATE(0, 1, 2);
  CAPTURE(kind);
  constexpr double kFallM = 0.01, kTickS = 0.0005;
  Bench bench(block_on_block(0.1, kFallM), kind);
  const double speed = std::sqrt(2 * kG * kFallM), fallen_j = bench.mass_kg(1) * kG * kFallM;
  // What springs and dampers of all nodes change by at this speed, with twice the stiffness of a compressed body.
  const Bench pressed(block_on_block(0, -1e-4), 0);
  double stiffness = 0;
  for (const Contacts::Block& contact : pressed.dynamics.contacts().tangents(pressed.state)) stiffness += contact.stiffness(2, 2);
  REQUIRE(stiffness > 0);
  const double most_n = 2 * stiffness * speed * kTickS * (1 + 0.004 * speed / (Contacts::kOnsetEdges * mean_edge_m(bench.body)));
  double before_n = 0, largest_n = 0, energy_j = bench.dynamics.energy(bench.state);
  const double gain = kind == 2 ? 0.02 : 1e-3;  // stages of a step do not know of a contact that begins in it
  for (double t = kTickS; t < 0.4; t += kTickS) {
    REQUIRE(bench.advance(t).converged);
    const double force_n = bench.force_on(1).z();
    CHECK(std::abs(force_n - before_n) < most_n);
    before_n = force_n;
    largest_n = std::max(largest_n, force_n);
    const double now_j = bench.dynamics.energy(bench.state);
    CHECK(now_j < energy_j + gain * fallen_j);
    energy_j = std::min(energy_j, now_j);
  }
  CHECK(largest_n > 2 * bench.mass_kg(1) * kG);
}

TEST_CASE("Tangents of contacts between bodies are differences of their forces, in products and in matrices") {
  LumpedBody rough = block_on_block(0, 0, GENERATE(false, true));
  for (Member& member : rough.members) member.friction = 2;  // nothing slips
  Bench bench(std::move(rough), 0);
  for (std::uint32_t i = bench.body.members[1].first_node; i < bench.body.members[1].end_node; ++i)
    bench.state.x[3 * i + 2] -= 1e-4;
  bench.dynamics.contacts().follow(bench.state);
  Random random(3);
  for (Eigen::Index i = 0; i < bench.state.x.size(); ++i)
    bench.state.x[i] += random.uniform(-1e-5, 1e-5), bench.state.v[i] = random.uniform(-1e-4, 1e-4);
  LumpedBody alone = bench.body;
  alone.members.clear();
  const Dynamics without(alone);
  const Dynamics& dynamics = bench.dynamics;
  const Matrix k = dense_stiffness(dynamics, bench.state) - dense_stiffness(without, bench.state),
               d = dense_damping(dynamics, bench.state) - dense_damping(without, bench.state);
  BlockMatrix assembled = dynamics.make_matrix(), apart = without.make_matrix();
  const std::vector<std::uint8_t> none(dynamics.nodes(), 0);
  for (int again = 0; again < 2; ++again) dynamics.assemble(bench.state, 0, 0.3, 0.7, none, false, assembled);
  without.assemble(bench.state, 0, 0.3, 0.7, none, false, apart);
  Vector product, product_apart;
  const auto forces = [&](const BodyState& s) {
    Vector f = Vector::Zero(s.x.size());
    dynamics.contacts().add_forces(s, f);
    return f;
  };
  constexpr double kStepM = 1e-8, kStepMS = 1e-6;
  REQUIRE(k.norm() > 100);
  for (Eigen::Index c = 0; c < bench.state.x.size(); ++c) {
    BodyState up = bench.state, down = bench.state;
    up.x[c] += kStepM, down.x[c] -= kStepM;
    CHECK((k.col(c) - (forces(down) - forces(up)) / (2 * kStepM)).norm() < 0.01 * k.norm());
    up = down = bench.state;
    up.v[c] += kStepMS, down.v[c] -= kStepMS;
    CHECK((d.col(c) - (forces(down) - forces(up)) / (2 * kStepMS)).norm() < 1e-3 * d.norm());
    const Vector unit = Vector::Unit(bench.state.x.size(), c);
    assembled.multiply(unit, product);
    apart.multiply(unit, product_apart);
    CHECK((product - product_apart - 0.7 * k.col(c) - 0.3 * d.col(c)).norm() < 1e-12 * k.norm());
  }
}

TEST_CASE("A body pressed onto another yields by the tangents that a patch is made of") {
  LumpedBody body = block_on_block(0);
  for (Member& member : body.members) member.friction = 2;  // rough: nothing slips
  const test::Yield yield = test::yield_of(body, Vec3(0.03, 0.03, 0.04));
  CHECK(yield.by_force == Approx(yield.by_tangents).epsilon(0.02));
  for (const auto& [node, weight] : Skin(body, 0.03).weights(yield.point)) CHECK(node >= body.members[1].first_node);
}

TEST_CASE("Bodies that are apart do not know of each other") {
  Bench bench(block_on_block(0, 0.05), 0);
  LumpedBody alone = bench.body;
  alone.members.clear();
  Bench without(std::move(alone), 0);
  for (Bench* b : {&bench, &without}) b->state.v[5] = 0.1, b->advance(0.05);
  CHECK(bench.state.x == without.state.x);
  CHECK_FALSE(bench.state.anchors);
}

namespace {

/// A half ball about a centre, of cubes moulded to it, flat at z = 0, where it is fixed; or turned over, and about z, so that
/// nodes of two do not meet nodes.
LumpedBody half_ball(double radius_m, int cells, bool up, const Vec3& centre) {
  const Mat3 turn = Eigen::AngleAxisd(0.4, Vec3::UnitZ()).toRotationMatrix();
  // The cube [-1, 1]^2 x [0, 1] is mapped to the half ball by shells: a point at max norm s lies at radius s R.
  const int n = 2 * cells + 1, layers = cells + 1;
  LumpedBody body = hexa_box(n, n, layers, {.young_pa = 10e3, .poisson = 0.3, .damping_s = 0.004});
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    Vec3& x = body.nodes[i];
    const Vec3 q = (x / kSpacingM - Vec3(cells, cells, 0)) / cells;
    const double shell = q.cwiseAbs().maxCoeff();
    x = q.norm() > 0 ? Vec3(radius_m * shell * q / q.norm()) : q;
    if (!up) x = turn * Vec3(x.x(), -x.y(), -x.z());
    x += centre;
  }
  return body;
}

}  // namespace

TEST_CASE("Two elastic balls press on each other with Hertz's force, to an eighth where two cells touch") {
  constexpr double kRadiusM = 0.04, kYoungPa = 10e3, kPoisson = 0.3;
  const LumpedBody body =
      joined({half_ball(kRadiusM, 4, true, Vec3::Zero()), half_ball(kRadiusM, 4, false, Vec3(0, 0, 2 * kRadiusM))}, named(2, 0));
  const Dynamics dynamics(body);
  const Member& upper = body.members[1];
  for (const double approach_m : {0.006, 0.009}) {
    BodyState state = dynamics.rest_state();
    for (std::uint32_t i = upper.first_node; i < upper.end_node; ++i) state.x[3 * i + 2] -= approach_m;
    const Equilibrium pressed = find_equilibrium(dynamics, state);
    REQUIRE(pressed.found);
    Vector f = Vector::Zero(state.x.size());
    dynamics.contacts().add_forces(pressed.state, f);
    double force_n = 0;
    for (std::uint32_t i = upper.first_node; i < upper.end_node; ++i) force_n += f[3 * i + 2];
    const double modulus_pa = kYoungPa / (2 * (1 - kPoisson * kPoisson));
    const double hertz_n = 4.0 / 3 * modulus_pa * std::sqrt(kRadiusM / 2) * std::pow(approach_m, 1.5);
    CAPTURE(approach_m);
    CHECK(force_n == Approx(hertz_n).epsilon(0.125));
  }
}

namespace {

/// A U on its side: two arms of 10 cells, one above the other with a gap of three, and a base that joins them.
LumpedBody sideways_u() {
  LumpedBody box = hexa_box(12, 3, 6, {.young_pa = 60e3, .poisson = 0.3, .damping_s = 0.01}), body = box;
  std::vector<std::uint32_t> number(box.nodes.size(), 0xffffffff);
  body.nodes.clear(), body.masses_kg.clear(), body.fixed.clear(), body.hexahedra.clear(), body.triangles.clear();
  std::map<std::array<std::uint32_t, 4>, std::pair<int, std::array<std::uint32_t, 4>>> faces;
  for (const Hexahedron& cell : box.hexahedra) {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t i : cell.nodes) middle += box.nodes[i] / 8;
    const Vec3 at = middle / kSpacingM;
    if (at.x() > 1 && at.z() > 1 && at.z() < 4) continue;
    Hexahedron& to = body.hexahedra.emplace_back(cell);
    for (std::uint32_t& i : to.nodes) {
      if (number[i] == 0xffffffff) {
        number[i] = static_cast<std::uint32_t>(body.nodes.size());
        body.nodes.push_back(box.nodes[i]);
        body.masses_kg.push_back(0);
        body.fixed.push_back(box.nodes[i].z() == 0);
      }
      i = number[i];
      body.masses_kg[i] += 1000 * std::pow(kSpacingM, 3) / 8;
    }
    constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& face : kFaces) {
      std::array<std::uint32_t, 4> corners{}, sorted{};
      for (std::size_t k = 0; k < 4; ++k) corners[k] = to.nodes[static_cast<std::size_t>(face[k])];
      sorted = corners;
      std::sort(sorted.begin(), sorted.end());
      auto& entry = faces[sorted];
      ++entry.first;
      entry.second = corners;
    }
  }
  for (const auto& [key, face] : faces) {
    if (face.first != 1) continue;
    const auto& c = face.second;
    body.triangles.push_back({c[0], c[1], c[2]});
    body.triangles.push_back({c[0], c[2], c[3]});
  }
  return body;
}

}  // namespace

TEST_CASE("A body that folds onto itself does not pass through itself, if it touches itself") {
  for (const bool touches : {true, false}) {
    std::vector<Member> members = named(1, 0.3);
    members[0].touches_itself = touches;
    LumpedBody body = joined({sideways_u()}, std::move(members));
    body.gravity_m_s2 = Vec3(0, 0, -kG);
    Bench bench(std::move(body), 0);
    REQUIRE(bench.advance(1.5).converged);
    double lowest = 1;  // of the upper arm's lower side, above the lower arm's upper side
    for (std::uint32_t i = 0; i < bench.body.nodes.size(); ++i)
      if (bench.body.nodes[i].z() > 3.9 * kSpacingM && bench.body.nodes[i].z() < 4.1 * kSpacingM)
        lowest = std::min(lowest, node_of(bench.state.x, i).z() - kSpacingM);
    CAPTURE(touches, lowest);
    if (touches) {
      CHECK(lowest > -0.1 * kSpacingM);
      CHECK(bench.contact_forces().norm() > 0);
      CHECK(bench.force_on(0).norm() < 1e-12 * bench.contact_forces().norm());
    } else {
      CHECK(lowest < -0.2 * kSpacingM);
    }
  }
}
