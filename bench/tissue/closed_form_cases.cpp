// Homogeneous deformations, for every law, and the cases of Rivlin and Lame.
//
//   uniaxial, equibiaxial   a cube of crooked cells between planes of symmetry, stretched: force over area [kPa]
//   shear                   its whole surface sheared by 0.5: shear and normal traction on its top [kPa]
//   torsion                 a cylinder of radius 10 mm and length 20 mm whose ends turn by 60 degrees and keep their shape
//   sphere                  10 to 20 mm, its inside moved out by 0.01 % or 30 %, free outside: the pressure inside [kPa]. Bodies
//                           accept no pressure load: the inside is moved, and the holding forces are summed.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "bench/tissue/boundary_problem.hpp"
#include "bench/tissue/closed_forms.hpp"
#include "bench/tissue/specimens.hpp"
#include "bench/tissue/tissue_case.hpp"

namespace palpate {
namespace {

using std::numbers::pi;

constexpr double kCubeM = 0.02, kHair = 1e-9;
constexpr int kCubeCells = 3;
constexpr double kPoisson = 0.45;

/// Holds the cube's side at x[axis] = 0 or its size.
void hold_side(BoundaryProblem& problem, const LumpedBody& body, int axis, bool far, double displacement_m) {
  for (const std::uint32_t i :
       nodes_where(body.nodes, [&](const Vec3& x) { return std::abs(x[axis] - (far ? kCubeM : 0)) < kHair; }))
    problem.hold(i, axis, displacement_m);
}

Vec3 reaction_of_side(const BoundaryProblem& problem, const LumpedBody& body, int axis) {
  Vec3 sum = Vec3::Zero();
  for (const std::uint32_t i : nodes_where(body.nodes, [&](const Vec3& x) { return x[axis] > kCubeM - kHair; }))
    sum += problem.reaction(i);
  return sum;
}

/// Stretches a cube along the first `axes` axes, free along the others.
TissueSolution stretch_cube(const SolidMaterial& material, TissueElement element, int cells, double stretch, int axes) {
  const LumpedBody body = crooked_cube(cells, kCubeM).body(solid_element(element), material);
  BoundaryProblem problem(body);
  for (int axis = 0; axis < 3; ++axis) hold_side(problem, body, axis, false, 0);
  for (int axis = 0; axis < axes; ++axis) hold_side(problem, body, axis, true, (stretch - 1) * kCubeM);
  problem.solve(4);
  return {body.nodes.size(), 1e-3 * reaction_of_side(problem, body, 0)[0] / (kCubeM * kCubeM)};
}

/// Traction on the top, component `axis`.
TissueSolution shear_cube(const SolidMaterial& material, TissueElement element, int cells, double shear, int component) {
  const LumpedBody body = crooked_cube(cells, kCubeM).body(solid_element(element), material);
  BoundaryProblem problem(body);
  const auto on_surface = [](const Vec3& x) { return x.minCoeff() < kHair || x.maxCoeff() > kCubeM - kHair; };
  for (const std::uint32_t i : nodes_where(body.nodes, on_surface)) problem.hold(i, Vec3(shear * body.nodes[i].y(), 0, 0));
  problem.solve(2);
  // Nodes on edges carry the tractions of two sides; virtual work over the whole surface separates them.
  double work = 0;
  for (const std::uint32_t i : nodes_where(body.nodes, on_surface)) work += problem.reaction(i)[component] * body.nodes[i].y();
  return {body.nodes.size(), 1e-3 * work / std::pow(kCubeM, 3)};
}

TissueCase exact_case(const std::string& name, double reference_pa, std::function<TissueSolution(TissueElement, int)> solve) {
  return {"homogeneous", name,
          "kPa",         1e-3 * reference_pa,
          "closed form", {kFiniteElements, std::end(kFiniteElements)},
          {kCubeCells},  std::move(solve)};
}

constexpr double kRadiusM = 0.01, kLengthM = 0.02, kTurn = pi / 3;

LumpedBody twisted(TissueElement element, int cells, const SolidMaterial& material) {
  return cylinder(cells, kRadiusM, kLengthM).body(solid_element(element), material);
}

/// Moment [N mm] about the axis, or force along it [N], on the end that turns.
TissueSolution twist_cylinder(const SolidMaterial& material, TissueElement element, int cells, bool moment) {
  const LumpedBody body = twisted(element, cells, material);
  BoundaryProblem problem(body);
  const auto is_end = [](const Vec3& x) { return x.z() < kHair || x.z() > kLengthM - kHair; };
  const std::vector<std::uint32_t> ends = nodes_where(body.nodes, is_end);
  constexpr int kShares = 4;
  for (int k = 1; k <= kShares; ++k) {
    for (const std::uint32_t i : ends) {
      const Vec3& x = body.nodes[i];
      const double turn = x.z() > kHair ? kTurn * k / kShares : 0;
      problem.hold(i, Vec3(Eigen::AngleAxisd(turn, Vec3::UnitZ()) * x - x));
    }
    problem.solve();
  }
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  for (const std::uint32_t i : ends) {
    if (body.nodes[i].z() < kHair) continue;
    force += problem.reaction(i);
    torque += (body.nodes[i] + problem.displacement(i)).cross(problem.reaction(i));
  }
  return {body.nodes.size(), moment ? 1e3 * torque.z() : force.z()};
}

constexpr double kInnerM = 0.01, kOuterM = 0.02;

TissueSolution inflate_sphere(const SolidMaterial& material, TissueElement element, int cells, double share) {
  const LumpedBody body = hollow_sphere_octant(cells, kInnerM, kOuterM).body(solid_element(element), material);
  BoundaryProblem problem(body);
  for (int axis = 0; axis < 3; ++axis)
    for (const std::uint32_t i : nodes_where(body.nodes, [&](const Vec3& x) { return x[axis] < kHair; })) problem.hold(i, axis);
  const auto inside = nodes_where(body.nodes, [](const Vec3& x) { return x.norm() < kInnerM * (1 + 1e-6); });
  for (const std::uint32_t i : inside) problem.hold(i, share * body.nodes[i]);
  problem.solve(share > 0.1 ? 6 : 1);
  double outwards = 0;
  for (const std::uint32_t i : inside) outwards += problem.reaction(i).dot(body.nodes[i].normalized());
  const double r = kInnerM * (1 + share);
  return {body.nodes.size(), 1e-3 * outwards / (4 * pi * r * r / 8)};
}

}  // namespace

std::vector<TissueCase> homogeneous_cases() {
  std::vector<TissueCase> cases;
  for (const NamedLaw& law : laws_at(kPoisson)) {
    const SolidMaterial m = law.material;
    for (const double stretch : {0.7, 1.5})
      cases.push_back(exact_case(fmt::format("{}, uniaxial {:g}", law.name, stretch), uniaxial_stress(m, stretch),
                                 [=](TissueElement e, int n) { return stretch_cube(m, e, n, stretch, 1); }));
    constexpr double kBoth = 1.3, kShear = 0.5, kNothing = 1e-9;
    cases.push_back(exact_case(fmt::format("{}, equibiaxial {:g}", law.name, kBoth), equibiaxial_stress(m, kBoth),
                               [=](TissueElement e, int n) { return stretch_cube(m, e, n, kBoth, 2); }));
    const Mat3 sheared = simple_shear_stress(m, kShear);
    for (const int component : {0, 1})
      if (std::abs(sheared(component, 1)) > kNothing * sheared.norm())  // laws of both invariants have no normal traction
        cases.push_back(
            exact_case(fmt::format("{}, shear {:g}, {} traction", law.name, kShear, component == 0 ? "shear" : "normal"),
                       sheared(component, 1), [=](TissueElement e, int n) { return shear_cube(m, e, n, kShear, component); }));
  }
  return cases;
}

std::vector<TissueCase> curved_cases() {
  std::vector<TissueCase> cases;
  const std::vector<TissueElement> elements{kFiniteElements, std::end(kFiniteElements)};
  SolidMaterial soft;
  soft.damping_s = 0;
  soft.poisson = 0.499;
  const TorsionAnswer torsion = torsion_of_cylinder(soft, kRadiusM, kTurn / kLengthM);
  for (const bool moment : {true, false})
    cases.push_back({"closed forms",
                     moment ? "torsion, moment, nu = 0.499" : "torsion, axial force, nu = 0.499",
                     moment ? "N mm" : "N",
                     moment ? 1e3 * torsion.moment_n_m : torsion.axial_n,
                     "Rivlin",
                     elements,
                     {2, 4, 6},
                     [=](TissueElement e, int n) { return twist_cylinder(soft, e, n, moment); }});
  for (const double share : {1e-4, 0.3})
    for (const double poisson : {0.3, 0.49}) {
      soft.poisson = poisson;
      const bool small = share < 0.1;
      const double reference = small ? lame_sphere_pressure(soft, kInnerM, kOuterM, share * kInnerM)
                                     : sphere_pressure(soft, kInnerM, kOuterM, share * kInnerM);
      cases.push_back({"closed forms",
                       fmt::format("thick sphere {:g} %, nu = {}", 100 * share, poisson),
                       "kPa",
                       1e-3 * reference,
                       small ? "Lame" : "radial equation",
                       elements,
                       {2, 4, 6},
                       [=](TissueElement e, int n) { return inflate_sphere(soft, e, n, share); }});
    }
  return cases;
}

}  // namespace palpate
