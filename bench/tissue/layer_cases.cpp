// Rigid frictionless indenters on a layer that is bonded below, and on a half-space: Hertz; Hayes et al.
//
// a = 10 mm, small strains (a depth of some 1e-4 a): flat punches and balls (paraboloids) on a layer as thick as a, and balls on
// one ten times as thick, whose references are those of Hertz with the factor of that depth (1.0005 and 1.0007). References are
// those of the integral equation of bench/calculix/layer.py, its numbers (bench/calculix/layer.csv) made dimensional: with s = G
// / (1 - nu),   punch P = s force h d;   ball d = depth h^2 / R, P = s force h^3 / R.
// The layer ends 8 a (thick: 40 a) from the axis, free there. The nodes in contact with a ball are found by releasing nodes that
// are pulled and holding those that would enter it, until none is left.
#include <fmt/format.h>

#include <cmath>

#include "bench/tissue/boundary_problem.hpp"
#include "bench/tissue/layer_numbers.hpp"
#include "bench/tissue/principal_law.hpp"
#include "bench/tissue/specimens.hpp"
#include "bench/tissue/tissue_case.hpp"

namespace palpate {
namespace {

constexpr double kContactM = 0.01, kHairM = 1e-9;
constexpr double kPunchDepthM = 1e-4 * kContactM, kBallM = 1e4 * kContactM;

SolidMaterial layer_material(const LayerNumbers& numbers) {
  SolidMaterial material;
  material.poisson = numbers.poisson;
  material.damping_s = 0;
  return material;
}

double thickness_m(const LayerNumbers& numbers) { return kContactM / numbers.a_over_h; }

/// G / (1 - nu) [Pa].
double contact_modulus(const LayerNumbers& numbers) { return Lame(layer_material(numbers)).mu / (1 - numbers.poisson); }

double layer_reference_n(const LayerNumbers& numbers) {
  const double h = thickness_m(numbers), s = contact_modulus(numbers);
  return numbers.is_ball ? s * numbers.force * h * h * h / kBallM : s * numbers.force * h * kPunchDepthM;
}

void press_ball(BoundaryProblem& problem, const std::vector<Vec3>& nodes, const std::vector<std::uint32_t>& top, double depth_m) {
  constexpr int kRoundsMax = 40;
  const auto below = [&](std::uint32_t i) { return depth_m - nodes[i].head<2>().squaredNorm() / (2 * kBallM); };
  for (const std::uint32_t i : top)
    if (below(i) > depth_m / 2) problem.hold(i, 2, -below(i));
  for (int round = 0; round < kRoundsMax; ++round) {
    problem.solve();
    bool changed = false;
    for (const std::uint32_t i : top) {
      const bool held = problem.holds(i, 2);
      if (held && problem.reaction(i).z() > 0)
        problem.release(i, 2);
      else if (!held && problem.displacement(i).z() > -below(i) + 1e-9 * depth_m)
        problem.hold(i, 2, -below(i));
      else
        continue;
      changed = true;
    }
    if (!changed) return;
  }
  throw std::runtime_error("what touches the ball does not settle");
}

TissueSolution press_layer(const LayerNumbers& numbers, TissueElement element, int cells) {
  const double h = thickness_m(numbers), outer_m = (numbers.a_over_h < 0.5 ? 40 : 8) * kContactM;
  const LumpedBody body = layer_quarter(cells, kContactM, h, outer_m).body(solid_element(element), layer_material(numbers));
  BoundaryProblem problem(body);
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    const Vec3& x = body.nodes[i];
    if (x.z() < -h + kHairM) problem.hold(i, Vec3::Zero());
    if (x.x() < kHairM) problem.hold(i, 0);
    if (x.y() < kHairM) problem.hold(i, 1);
  }
  const auto top = nodes_where(body.nodes, [](const Vec3& x) { return x.z() > -kHairM; });
  if (numbers.is_ball) {
    press_ball(problem, body.nodes, top, numbers.depth * h * h / kBallM);
  } else {
    for (const std::uint32_t i : top)
      if (body.nodes[i].head<2>().norm() < kContactM + kHairM) problem.hold(i, 2, -kPunchDepthM);
    problem.solve();
  }
  double force_n = 0;
  for (const std::uint32_t i : top)
    if (problem.holds(i, 2)) force_n -= problem.reaction(i).z();
  return {body.nodes.size(), 4 * force_n};
}

}  // namespace

std::vector<TissueCase> layer_cases() {
  std::vector<TissueCase> cases;
  for (const LayerNumbers& numbers : kLayerNumbers) {
    const bool thick = numbers.a_over_h < 0.5;
    const std::string on = thick ? "Hertz, ball" : numbers.is_ball ? "layer, ball" : "layer, punch";
    cases.push_back({"layers",
                     fmt::format("{}, nu = {}", on, numbers.poisson),
                     "mN",
                     1e3 * layer_reference_n(numbers),
                     thick ? "Hertz" : "Hayes",
                     {kFiniteElements, std::end(kFiniteElements)},
                     thick ? std::vector<int>{2, 4, 6} : std::vector<int>{4, 8, 12},
                     [&numbers](TissueElement e, int n) {
                       const TissueSolution found = press_layer(numbers, e, n);
                       return TissueSolution{found.nodes, 1e3 * found.value};
                     }});
  }
  return cases;
}

}  // namespace palpate
