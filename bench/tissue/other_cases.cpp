// Cook's membrane, and cases of FEBio's verification suite (github.com/febiosoftware/TestSuite, Verify/) with the laws of this
// project.
//
//   Cook, plane stress    E = 1, nu = 1/3, a shear load of 1 on the free edge, small strains: u_y of that edge's middle is
//                         23.96 (published; Simo and Rifai, IJNME 29 (1990) and many after them). A membrane 2 mm thick, half of
//                         it.
//   Cook, plane strain    the same for nu = 0.3 and 0.49, by CalculiX 2.20 (bench/calculix/README.md)
//   mi01   a cube of one element, E = 1, nu = 0.45, stretched to twice its length, its sides free: closed form [mPa]
//   te01   one tetrahedron whose nodes slide along the axes, its top pushed down: closed form of the motion of its top [mm]. The
//          original has c1 = 1, k = 1000 and a force of 0.5; here E and nu of the same small strains
//   ma02   20 x 10 x 10 mm, ends glued, stretched by a twentieth (originally by half, where laws differ): the force, by CalculiX
//          [mN]
#include <fmt/format.h>

#include <cmath>

#include "bench/tissue/boundary_problem.hpp"
#include "bench/tissue/closed_forms.hpp"
#include "bench/tissue/specimens.hpp"
#include "bench/tissue/tissue_case.hpp"

namespace palpate {
namespace {

constexpr double kSmallest = 1e-9;
const std::vector<TissueElement> kBoth{std::begin(kFiniteElements), std::end(kFiniteElements)};

/// u_y E t / F of the free edge's middle; requires an even number of cells.
TissueSolution bend_membrane(double poisson, bool plane_stress, TissueElement element, int cells) {
  constexpr double kThickM = 1e-3, kLoadN = 1e-5, kRightM = 48e-3, kTopM = 60e-3;
  SolidMaterial material;
  material.poisson = poisson;
  material.damping_s = 0;
  const LumpedBody body = cooks_membrane(cells, kThickM).body(solid_element(element), material);
  BoundaryProblem problem(body);
  std::uint32_t middle = 0;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    const Vec3& x = body.nodes[i];
    if (!plane_stress || x.z() < kSmallest) problem.hold(i, 2);
    if (x.x() < kSmallest) problem.hold(i, 0), problem.hold(i, 1);
    if (x.x() < kRightM - kSmallest) continue;
    const bool at_end = x.y() < 44e-3 + kSmallest || x.y() > kTopM - kSmallest;
    problem.push(i, Vec3(0, kLoadN / cells / 2 * (at_end ? 0.5 : 1), 0));
    if (std::abs(x.y() - (44e-3 + kTopM) / 2) < kSmallest && x.z() < kSmallest) middle = i;
  }
  problem.solve();
  return {body.nodes.size(), problem.displacement(middle).y() * material.young_pa * kThickM / kLoadN};
}

SolidMaterial matter_of(double young_pa, double poisson) {
  SolidMaterial material;
  material.young_pa = young_pa;
  material.poisson = poisson;
  material.damping_s = 0;
  return material;
}

constexpr double kMi01Stretch = 2;

TissueSolution solve_mi01(TissueElement element, int cells) {
  const LumpedBody body = box_mesh({cells, cells, cells}, Vec3::Ones()).body(solid_element(element), matter_of(1, 0.45));
  BoundaryProblem problem(body);
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    const Vec3& x = body.nodes[i];
    for (int axis = 0; axis < 3; ++axis)
      if (x[axis] < kSmallest) problem.hold(i, axis);
    if (x.z() > 1 - kSmallest) problem.hold(i, 2, kMi01Stretch - 1);
  }
  problem.solve(10);
  double force = 0;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i)
    if (body.nodes[i].z() > 1 - kSmallest) force += problem.reaction(i).z();
  return {body.nodes.size(), 1e3 * force};
}

/// E and nu of a law with mu = 2 c1 = 2, K = 1000.
SolidMaterial te01_material() {
  constexpr double kMu = 2, kBulk = 1000;
  return matter_of(9 * kBulk * kMu / (3 * kBulk + kMu), (3 * kBulk - 2 * kMu) / (2 * (3 * kBulk + kMu)));
}
constexpr double kTe01N = 0.5;

TissueSolution solve_te01(TissueElement, int) {
  LumpedBody body;
  body.nodes = {Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  body.masses_kg.assign(4, 1);
  body.fixed = {1, 0, 0, 0};
  body.tetrahedra = {{{0, 1, 2, 3}, 0}};
  body.materials = {te01_material()};
  BoundaryProblem problem(body);
  for (std::uint32_t i = 1; i < 4; ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (axis + 1 != static_cast<int>(i)) problem.hold(i, axis);
  problem.push(3, Vec3(0, 0, -kTe01N));
  problem.solve(10);
  return {4, -1e3 * problem.displacement(3).z()};
}

/// The force on its top is V P_33 times the gradient of its shape function, 1 / m: P_33 = -6 F.
double te01_reference_mm() {
  double low = 0.3, high = 1;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    (uniaxial_stress(te01_material(), middle) < -6 * kTe01N ? low : high) = middle;
  }
  return 1e3 * (1 - low);
}

TissueSolution solve_ma02(TissueElement element, int cells) {
  constexpr double kLongM = 0.02, kHighM = 0.01;
  const LumpedBody body =
      box_mesh({2 * cells, cells, cells}, Vec3(kLongM, kHighM, kHighM)).body(solid_element(element), matter_of(10e3, 0.45));
  BoundaryProblem problem(body);
  const auto pulled = nodes_where(body.nodes, [](const Vec3& x) { return x.x() > kLongM - kSmallest; });
  for (const std::uint32_t i : nodes_where(body.nodes, [](const Vec3& x) { return x.x() < kSmallest; }))
    problem.hold(i, Vec3::Zero());
  for (const std::uint32_t i : pulled) problem.hold(i, Vec3(kLongM / 20, 0, 0));
  problem.solve();
  double force = 0;
  for (const std::uint32_t i : pulled) force += problem.reaction(i).x();
  return {body.nodes.size(), 1e3 * force};
}

}  // namespace

std::vector<TissueCase> membrane_cases() {
  constexpr double kPublished = 23.96, kOf03 = 21.94, kOf049 = 18.72;
  std::vector<TissueCase> cases;
  const std::vector<int> cells{4, 8, 16, 32};
  cases.push_back({"membrane", "Cook, plane stress, nu = 1/3", "F/Et", kPublished, "published", kBoth, cells,
                   [](TissueElement e, int n) { return bend_membrane(1.0 / 3, true, e, n); }});
  for (const auto& [poisson, reference] : {std::pair{0.3, kOf03}, {0.49, kOf049}})
    cases.push_back({"membrane", fmt::format("Cook, plane strain, nu = {}", poisson), "F/Et", reference, "CalculiX", kBoth, cells,
                     [poisson = poisson](TissueElement e, int n) { return bend_membrane(poisson, false, e, n); }});
  return cases;
}

std::vector<TissueCase> febio_cases() {
  constexpr double kMa02Mn = 51.24;
  return {
      {"FEBio",
       "mi01, drawn to twice its length",
       "mPa",
       1e3 * uniaxial_stress(matter_of(1, 0.45), kMi01Stretch),
       "closed form",
       kBoth,
       {1},
       solve_mi01},
      {"FEBio", "te01, one tetrahedron", "mm", te01_reference_mm(), "closed form", {TissueElement::tetrahedron}, {1}, solve_te01},
      {"FEBio", "ma02, glued ends", "mN", kMa02Mn, "CalculiX", kBoth, {2, 4, 8}, solve_ma02}};
}

}  // namespace palpate
