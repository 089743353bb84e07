// Hexahedra in lanes of single precision against the one kernel, cell by cell in double; explicit steps of them against TR-BDF2
// at a step at which that has converged.
#include "server/body/hexa_forces.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"
#include "common/io/spinning_thread_pool.hpp"
#include "server/dynamics/integrator_selection.hpp"
#include "tests/support/explicit_steppers.hpp"
#include "tests/support/tool_bench.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kSolidTopM = 4 * kSpacingM;

NodeArrays forces_of(const Dynamics& dynamics, const BodyState& state) {
  const HexaForces hexahedra(dynamics);
  NodeArrays u(dynamics.nodes()), v(dynamics.nodes()), f(dynamics.nodes());
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    u.set(i, at_node(state.x, i) - dynamics.body().nodes[i]);
    v.set(i, at_node(state.v, i));
  }
  for (const bool odd : {false, true})
    for (std::size_t k = 0; k < hexahedra.slabs(odd); ++k) hexahedra.add_forces(odd, k, u, v, f);
  return f;
}

/// Largest difference of a node's force, relative to the largest.
double worst(const LumpedBody& body, double shift_m, double speed_m_s) {
  const Dynamics dynamics(body);
  const BodyState state = random_state(dynamics, 5, shift_m, speed_m_s);
  const NodeArrays f = forces_of(dynamics, state);
  Vector expected;
  dynamics.forces(state.x, state.v, expected);
  double most = 0, off = 0;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    most = std::max(most, at_node(expected, i).norm());
    off = std::max(off, (f.at(i) - at_node(expected, i)).norm());
  }
  return off / most;
}

/// Removes some cells, so that rows end at irregular places.
LumpedBody with_holes(LumpedBody body) {
  std::vector<Hexahedron> kept;
  for (std::size_t k = 0; k < body.hexahedra.size(); ++k)
    if (k % 7 != 3 && k % 11 != 5) kept.push_back(body.hexahedra[k]);
  body.hexahedra = kept;
  return body;
}

/// Adds a ligament from near the middle of the top to a place outside.
void add_ligament(LumpedBody& body) {
  const std::uint32_t held = 62 + 50, anchor = static_cast<std::uint32_t>(body.nodes.size());
  body.nodes.push_back(body.nodes[held] + Vec3(0, -0.05, 0.03));
  body.masses_kg.push_back(1e-3);
  body.fixed.push_back(1);
  body.elements.push_back({held, anchor, (body.nodes[anchor] - body.nodes[held]).norm(), 20, 0.02});
}

SolidMaterial soft(double damping_s) { return {SolidLaw::neo_hookean, 8e3, 0.45, damping_s}; }

}  // namespace

TEST_CASE(
    "Forces of hexahedra in single precision are those of the kernel to 2e-6 of the largest, boxes or not, in rows or not") {
  const SolidMaterial material = GENERATE(
      SolidMaterial{SolidLaw::neo_hookean, 8e3, 0.49, 0.01}, SolidMaterial{SolidLaw::corotational, 8e3, 0.3, 0},
      SolidMaterial{SolidLaw::mooney_rivlin, 8e3, 0.45, 0.01, 0.4}, SolidMaterial{SolidLaw::veronda_westmann, 8e3, 0.45, 0.01, 3},
      SolidMaterial{SolidLaw::ogden, 8e3, 0.45, 0.01, 0.3, {5, -4}, {{0.6, 0, 0.8}, 2, 1}});
  LumpedBody box = hexa_box(13, 5, 6, material);
  LumpedBody crooked = hexa_box(6, 5, 4, material);
  Random random(3);
  for (Vec3& x : crooked.nodes) x += random_vector(random, 0.1 * kSpacingM);
  LumpedBody both = hexa_box(12, 4, 4, material);
  for (std::size_t i = 0; i < 40; ++i) both.nodes[i] += random_vector(random, 0.1 * kSpacingM);
  for (const double shift_m : {1e-5, 0.1 * kSpacingM})
    for (const LumpedBody& body : {box, with_holes(box), crooked, both}) {
      CAPTURE(shift_m, body.hexahedra.size());
      CHECK(worst(body, shift_m, 0.05) < 2e-6);
    }
}

TEST_CASE("Hexahedra in single precision have the same bits at every width of the processor's vectors") {
  const LumpedBody body = with_holes(hexa_box(13, 5, 6, soft(0.01)));
  const Dynamics dynamics(body);
  const BodyState state = random_state(dynamics, 5, 0.002, 0.1);
  NodeArrays u(dynamics.nodes()), v(dynamics.nodes());
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    u.set(i, at_node(state.x, i) - body.nodes[i]);
    v.set(i, at_node(state.v, i));
  }
  const HexaForces hexahedra(dynamics);
  std::vector<NodeArrays> found;
  for (const auto& loops : hexa_force_loops()) {
    NodeArrays& f = found.emplace_back(dynamics.nodes());
    for (const bool odd : {false, true})
      for (std::size_t k = 0; k < hexahedra.slabs(odd); ++k) loops.run(hexahedra.materials(), hexahedra.cells(odd, k), u, v, f);
  }
  for (const NodeArrays& f : found) {
    CHECK(f.x == found.front().x);
    CHECK(f.y == found.front().y);
    CHECK(f.z == found.front().z);
  }
}

TEMPLATE_TEST_CASE("A solid of hexahedra that a tool holds is moved explicitly as by an implicit integrator that has converged",
                   "", Leapfrog, Stabilised) {
  constexpr bool kDamped = std::is_same_v<TestType, Stabilised>;
  ToolBench bench(hexa_box(5, 5, 5, soft(kDamped ? 0.01 : 0.0005)));
  TestType stepper(bench.dynamics, bench.skin);
  const Vec3 home = bench.body.nodes[bench.port.node];
  const auto way = [&](double t) { return Vec3(home + Vec3(0.006 * std::sin(12 * t), 0.004 * (1 - std::cos(9 * t)), 0)); };
  const auto truth = bench.felt(bench.fine, 0.0005, 0.5, way);
  CHECK(ToolBench::apart(bench.felt(stepper, 0.010, 0.5, way), truth) < 0.01);
}

TEMPLATE_TEST_CASE(
    "A tool that presses a solid of hexahedra, strokes it and lets go feels what it feels with an implicit integrator", "",
    Leapfrog, Stabilised) {
  constexpr bool kDamped = std::is_same_v<TestType, Stabilised>;
  LumpedBody body = hexa_box(5, 5, 5, soft(kDamped ? 0.01 : 0.0005));
  if (GENERATE(false, true)) add_ligament(body);
  ToolBench bench(body, ContactKind::touch);
  TestType stepper(bench.dynamics, bench.skin);
  const auto way = [](double t) {
    const double in_m = 0.008 * std::min({1.0, t / 0.1, std::max(0.0, (0.45 - t) / 0.05)});
    return Vec3(0.03 + 0.05 * std::max(0.0, t - 0.15), 0.041, kSolidTopM + 0.001 - in_m);
  };
  const auto truth = bench.felt(bench.fine, 0.0005, 0.6, way);
  const auto felt = bench.felt(stepper, 0.010, 0.6, way);
  REQUIRE(truth[30].norm() > 0.1);
  CHECK(ToolBench::apart(felt, truth) < 0.02);
  CHECK(felt.back() == Vec3::Zero());
}

TEST_CASE("A solid without dampers that was bent far swings on at its energy, and one with them loses it in every frame") {
  const bool damped = GENERATE(false, true);
  const LumpedBody body = hexa_box(5, 5, 5, soft(damped ? 0.01 : 0));
  const Dynamics dynamics(body);
  Leapfrog leapfrog(dynamics, Skin());
  Stabilised stabilised(dynamics, Skin());
  Stepper& stepper = damped ? static_cast<Stepper&>(stabilised) : leapfrog;
  BodyState state = dynamics.rest_state();
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (!body.fixed[i]) at_node(state.x, i).x() += 0.6 * body.nodes[i].z();
  const double begin_j = dynamics.energy(state);
  double before_j = begin_j;
  std::vector<ToolPort> ports;
  for (int k = 1; k <= 60; ++k) {
    REQUIRE(stepper.advance(state, ports, 0.020 * k, 0.010, {}).cut_steps == 0);
    const double now_j = dynamics.energy(state);
    if (damped) CHECK(now_j <= before_j + 1e-9 * begin_j);
    CHECK(now_j < 1.1 * begin_j);
    before_j = now_j;
  }
  if (damped)
    CHECK(before_j < 1e-3 * begin_j);
  else
    CHECK(before_j > 0.9 * begin_j);
}

TEST_CASE("A squeezed solid is stepped in shorter steps, as much as its stiffest element asks for") {
  LumpedBody body = hexa_box(5, 5, 5, soft(0));
  const Dynamics dynamics(body);
  const HexaForces hexahedra(dynamics);
  NodeArrays u(dynamics.nodes());
  CHECK(hexahedra.growth(u).stiffness == 1);
  CHECK(hexahedra.growth(u).damping == Approx(1));
  // Stretched to 1.5 along x: F F^T has 2.25, and dP/dF is known from finite differences of P.
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) u.set(i, {0.5 * body.nodes[i].x(), 0, 0});
  const auto growth = hexahedra.growth(u);
  CHECK(growth.damping == Approx(2.25).epsilon(1e-4));
  const ElementMaterial material(body.materials[0]);
  const auto stiffest = [&](const Mat3& f) {
    Eigen::Matrix<double, 9, 9> a;
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 9; ++k) {
      Mat3 way = Mat3::Zero();
      way(k) = kStep;
      a.col(k) = ((elastic_stress(material, f + way) - elastic_stress(material, f - way)) / (2 * kStep)).reshaped();
    }
    Vector y = Vector::Ones(9);
    for (int k = 0; k < 2000; ++k) y = (a * y).normalized();
    return y.dot(a * y);
  };
  CHECK(growth.stiffness == Approx(stiffest(Vec3(1.5, 1, 1).asDiagonal()) / stiffest(Mat3::Identity())).epsilon(1e-3));
}

TEST_CASE("A solid that threads share moves to the same bits as one that one thread moves") {
  const LumpedBody body = hexa_box(14, 14, 14, soft(0.001));
  const Dynamics dynamics(body);
  const Skin skin(body);
  const auto moved_by = [&](std::size_t threads) {
    SpinningThreadPool pool(threads);
    Leapfrog stepper(dynamics, skin);
    REQUIRE(stepper.hexahedra().size() >= ExplicitBody::kHexaWorthSharing);
    stepper.use_threads(pool);
    BodyState state = random_state(dynamics, 3, 0.0005, 0.05);
    std::vector<ToolPort> ports(1);
    ports[0].parameters = {800, 0.3};
    const auto tool = [](std::size_t, double t) { return ToolAt{Vec3(0.1, 0.1, 13 * kSpacingM - 0.2 * t), Vec3(0, 0, -0.2)}; };
    REQUIRE(stepper.advance(state, ports, 0.010, 0.010, tool).cut_steps == 0);
    return state;
  };
  const BodyState one = moved_by(1);
  for (const std::size_t threads : {2, 3}) {
    const BodyState shared = moved_by(threads);
    CHECK(shared.x == one.x);
    CHECK(shared.v == one.v);
  }
}

TEST_CASE("Solids of hexahedra are stepped explicitly where that is cheaper, those that fade or have a capsule never") {
  const auto reason = [](LumpedBody body, IntegratorKind integrator, ContactKind contact = ContactKind::touch) {
    Scene scene;
    scene.body = std::move(body);
    scene.tool.contact = contact;
    scene.solver.integrator = integrator;
    const Dynamics dynamics(scene.body);
    return choose_stepper(scene, dynamics, Skin()).reason;
  };
  CHECK(reason(hexa_box(14, 14, 14, soft(0.0005)), IntegratorKind::automatic).starts_with("explicit"));
  LumpedBody fading = hexa_box(14, 14, 14, soft(0.0005));
  fading.relaxation = {{0.3, 1}};
  CHECK(reason(fading, IntegratorKind::automatic).starts_with("tr-bdf2"));
  CHECK_THROWS_AS(reason(fading, IntegratorKind::leapfrog), InputError);
  CHECK(reason(solid_box(6, 6, 6, soft(0)), IntegratorKind::automatic).starts_with("tr-bdf2"));
  CHECK(reason(hexa_box(14, 14, 14, soft(0.05)), IntegratorKind::automatic, ContactKind::attach).starts_with("tr-bdf2"));
  CHECK(reason(hexa_box(14, 14, 14, soft(0.05)), IntegratorKind::automatic, ContactKind::touch).starts_with("stabilised"));
}
