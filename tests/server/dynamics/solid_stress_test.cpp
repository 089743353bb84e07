// Solids of every kind in states that no tissue survives, stepped by the integrator that is selected for them.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/limits.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/dynamics/integrator_selection.hpp"
#include "server/scene/capsule.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

enum class IllTreatment { crushed, inside_out, sheared, poked };

double log_uniform(Random& random, double low, double high) { return std::exp(random.uniform(std::log(low), std::log(high))); }

SolidMaterial any_material(Random& random, int trial) {
  constexpr std::array kLaws{SolidLaw::neo_hookean, SolidLaw::corotational, SolidLaw::mooney_rivlin, SolidLaw::veronda_westmann,
                             SolidLaw::ogden};
  constexpr std::array kPoisson{0.3, 0.45, 0.49};
  SolidMaterial m;
  m.law = kLaws[static_cast<std::size_t>(trial) % kLaws.size()];
  m.young_pa = log_uniform(random, 1e3, 1e5);
  m.poisson = kPoisson[random.bits() % kPoisson.size()];
  m.damping_s = random.chance(0.2) ? 0 : random.uniform(0, 0.02);
  if (m.law == SolidLaw::mooney_rivlin) m.shape = random.uniform(0, 1);
  if (m.law == SolidLaw::veronda_westmann) m.shape = random.uniform(1, 10);
  if (m.law == SolidLaw::ogden) {
    m.shape = 0.3;
    m.exponents = {random.uniform(1, 8), -random.uniform(1, 8)};
  }
  if (random.chance(0.3)) m.fibres = {{0.6, 0, 0.8}, random.uniform(0.1, 10), random.uniform(0, 5)};
  return m;
}

LumpedBody any_solid(Random& random, int trial) {
  const SolidMaterial material = any_material(random, trial);
  const bool hexahedra = random.chance(0.6), crooked = random.chance(0.5);
  LumpedBody body = hexahedra ? hexa_box(5, 4, 4, material) : solid_box(5, 4, 4, material);
  for (Vec3& x : body.nodes)
    if (crooked) x += random_vector(random, (hexahedra ? 0.15 : 0.08) * kSpacingM);
  if (random.chance(0.3)) add_capsule(body, {log_uniform(random, 1e5, 1e7), 1e-4, 0.3, 0.01});
  if (random.chance(0.3))
    body.relaxation = {{random.uniform(0.1, 0.5), random.uniform(0.02, 2)}, {random.uniform(0.1, 0.4), random.uniform(0.02, 5)}};
  if (random.chance(0.3)) {
    constexpr std::uint32_t kHeld = 72;
    const auto anchor = static_cast<std::uint32_t>(body.nodes.size());
    body.nodes.push_back(body.nodes[kHeld] + Vec3(0, -0.05, 0.03));
    body.masses_kg.push_back(1e-3);
    body.fixed.push_back(1);
    body.elements.push_back({kHeld, anchor, (body.nodes[anchor] - body.nodes[kHeld]).norm(), random.uniform(5, 200), 0.02});
  }
  return body;
}

void treat(IllTreatment treatment, Random& random, const LumpedBody& body, BodyState& state) {
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    if (body.fixed[i]) continue;
    if (treatment == IllTreatment::crushed) at_node(state.x, i).z() *= random.uniform(0.2, 0.3);
    if (treatment == IllTreatment::inside_out) at_node(state.x, i) += random_vector(random, 0.6 * kSpacingM);
    if (treatment == IllTreatment::sheared) at_node(state.x, i).x() += 1.2 * body.nodes[i].z();
  }
}

/// Simulates two seconds. An isolated body gains no energy, except with relaxation, where bending persists for a while. The tool
/// leaves in the end and touches nothing from afar.
void ill_treat(std::uint64_t seed, int trial) {
  constexpr double kTopM = 3 * kSpacingM, kAwayS = 0.3, kAwayMS = 1, kFrameS = 0.05;
  CAPTURE(seed, trial);
  Random random(seed + static_cast<std::uint64_t>(trial));
  Scene scene;
  scene.body = any_solid(random, trial);
  const Dynamics dynamics(scene.body);
  const Skin skin(scene.body, 0.02);
  const ChosenStepper chosen = choose_stepper(scene, dynamics, skin);
  CAPTURE(chosen.reason);
  const auto treatment = static_cast<IllTreatment>(random.bits() % 4);
  BodyState state = dynamics.rest_state();
  treat(treatment, random, scene.body, state);
  std::vector<ToolPort> ports(treatment == IllTreatment::poked ? 1 : 0);
  for (ToolPort& port : ports) port.parameters = {1000, 0.5};
  const double speed_m_s = random.uniform(0.1, 2);
  const auto tool = [&](std::size_t, double t) {
    const double down_m = std::min(speed_m_s * t, 0.035), up_m = kAwayMS * std::max(0.0, t - kAwayS);
    return ToolAt{Vec3(0.04 + 0.1 * t, 0.03, kTopM + 0.002 - down_m + up_m), Vec3::Zero()};
  };
  // As in rollouts: few steps, far from converged, which may give up but must not diverge.
  Integrator roughly(dynamics, skin,
                     {.tolerance_m = 0.01 * kSpacingM,
                      .solver = LinearSolver::Method::conjugate_gradients,
                      .solve_tolerance = 0.1,
                      .event_step_s = 0.01,
                      .most_iterations = 24});
  const auto look_ahead = [&] {
    BodyState ahead = state;
    std::vector<ToolPort> there = ports;
    for (int step = 0; step < 3; ++step)
      if (!roughly.advance(ahead, there, ahead.time_s + 0.05, 0.05, tool).converged) break;
    return ahead;
  };
  double begin_j = dynamics.energy(state);
  for (int k = 1; k <= 40; ++k) {
    REQUIRE(chosen.stepper->advance(state, ports, kFrameS * k, chosen.step_s, tool).converged);
    const double now_j = dynamics.energy(state);
    REQUIRE(std::isfinite(now_j));
    REQUIRE(state.x.allFinite());
    if (!ports.empty()) REQUIRE(look_ahead().x.cwiseAbs().maxCoeff() < kWorldExtentM);
    if (!ports.empty())
      begin_j = now_j;
    else if (scene.body.relaxation.empty())
      REQUIRE(now_j <= 1.02 * begin_j + 1e-9);
  }
  for (const ToolPort& port : ports) CHECK_FALSE(port.touching);
}

}  // namespace

TEST_CASE(
    "Solids of any law, with fibres, capsules, ligaments and stress that fades, outlive being crushed, inverted, sheared, "
    "poked") {
  for (int trial = 0; trial < 40; ++trial) ill_treat(1, trial);
}

TEST_CASE("A look ahead in few steps that flies apart is given up") { ill_treat(1'000'000, 106); }

TEST_CASE("A tool that meets a body in turmoil answers for the iterations of its contact alone") { ill_treat(1'000'000, 574); }

TEST_CASE("A thousand solids of any kind outlive any treatment", "[.soak]") {
  for (int trial = 0; trial < 1000; ++trial) ill_treat(1'000'000, trial);
}
