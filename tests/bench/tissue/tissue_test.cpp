// Bodies against closed forms and classic solutions, on small meshes of palpate-lab tissue. If a result is not exact, the
// tolerance is the observed error (docs/results/tissue.md) plus a tenth, and the error falls with the observed order.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "bench/tissue/advice.hpp"
#include "bench/tissue/boundary_problem.hpp"
#include "bench/tissue/closed_forms.hpp"
#include "bench/tissue/layer_numbers.hpp"
#include "bench/tissue/specimens.hpp"
#include "bench/tissue/tissue_case.hpp"
#include "server/elements/element_material.hpp"

using namespace palpate;
using std::numbers::pi;

namespace {

constexpr double kExact = 1e-7;  // a solution is balanced to 1e-8 of its loads

double error_of(const std::string& name, TissueElement element, int cells) {
  const TissueCase& of = tissue_case(name);
  return of.solve(element, cells).value / of.reference - 1;
}

SolidMaterial soft(double poisson) {
  SolidMaterial material;
  material.poisson = poisson;
  material.damping_s = 0;
  return material;
}

double mass_of(const LumpedBody& body) {
  double sum = 0;
  for (const double m : body.masses_kg) sum += m;
  return sum;
}

}  // namespace

TEST_CASE("Every law written in principal stretches is the law of the kernel") {
  Mat3 f;
  f << 1.2, 0.3, -0.1, 0.05, 0.8, 0.2, 0.1, -0.15, 1.1;
  for (const NamedLaw& law : laws_at(0.4)) {
    INFO(law.name);
    const Mat3 p = elastic_stress(ElementMaterial(law.material), f);
    CHECK((stress_at(law.material, f) - p).norm() < 1e-10 * p.norm());
    const Vec3 l(1.3, 0.9, 0.8), g = principal_stress(law.material, l);
    for (int k = 0; k < 3; ++k) {
      const Vec3 step = 1e-5 * Vec3::Unit(k);
      const double slope = (energy_density(law.material, l + step) - energy_density(law.material, l - step)) / 2e-5;
      CHECK(slope == Approx(g[k]).epsilon(1e-7));
    }
  }
}

TEST_CASE("Uniaxial, equibiaxial and sheared cubes of crooked cells meet the closed forms of every law exactly") {
  for (const TissueCase& c : homogeneous_cases())
    for (const TissueElement element : c.elements) {
      INFO(c.name << ", " << kTissueElementNames[static_cast<int>(element)]);
      CHECK(std::abs(c.solve(element, c.cells.front()).value / c.reference - 1) < kExact);
    }
}

TEST_CASE("A column relaxes, creeps and has the hysteresis that its Prony series says") {
  for (const TissueCase& c : time_cases()) {
    INFO(c.name);
    CHECK(std::abs(c.solve(TissueElement::hexahedron, 5).value / c.reference - 1) < 0.003);
  }
}

TEST_CASE("A twisted cylinder of hexahedra has the moment and the axial force that Rivlin found, with second order") {
  const double coarse = error_of("torsion, moment, nu = 0.499", TissueElement::hexahedron, 2);
  const double fine = error_of("torsion, moment, nu = 0.499", TissueElement::hexahedron, 4);
  INFO("too soft by " << coarse << " and " << fine);
  CHECK(std::abs(fine) < 0.044);
  CHECK(coarse / fine == Approx(4).margin(0.5));
  CHECK(std::abs(error_of("torsion, axial force, nu = 0.499", TissueElement::hexahedron, 4)) < 0.03);
}

TEST_CASE("Rivlin's torsion is that of linear theory for a small turn, and its axial force a quarter of it times the turn") {
  const double mu = Lame(soft(0.499)).mu, a = 0.01, turn = 1e-3;
  const TorsionAnswer found = torsion_of_cylinder(soft(0.499), a, turn);
  CHECK(found.moment_n_m == Approx(mu * turn * pi * std::pow(a, 4) / 2).epsilon(1e-6));
  CHECK(found.axial_n == Approx(-turn / 2 * found.moment_n_m).epsilon(1e-12));
}

TEST_CASE("The pressure in a thick sphere is Lame's for a small strain, and that of a large one follows from shells") {
  for (const double poisson : {0.3, 0.49})
    CHECK(sphere_pressure(soft(poisson), 0.01, 0.02, 1e-7) ==
          Approx(lame_sphere_pressure(soft(poisson), 0.01, 0.02, 1e-7)).epsilon(2e-4));
  // Nearly incompressible: integral of the difference of the principal stresses over r.
  const SolidMaterial hard_to_squeeze = soft(0.49999);
  const double moved = 0.003, a3 = 1e-6, out3 = std::pow(0.013, 3) - a3;
  double pressure = 0;
  constexpr int kShells = 20000;
  for (int i = 0; i < kShells; ++i) {
    const double rest = 0.01 + 0.01 * (i + 0.5) / kShells, r = std::cbrt(rest * rest * rest + out3), around = r / rest;
    const double along = 1 / (around * around),
                 w = energy_by_first_invariant(hard_to_squeeze, along * along + 2 * around * around);
    pressure += 2 * w * (around * around - along * along) * 2 / r * along * 0.01 / kShells;
  }
  CHECK(sphere_pressure(hard_to_squeeze, 0.01, 0.02, moved) == Approx(pressure).epsilon(1e-3));
}

TEST_CASE("A thick sphere of hexahedra is within 2 % of Lame's pressure four cells through, and locks no more near nu = 1/2") {
  CHECK(std::abs(error_of("thick sphere 0.01 %, nu = 0.3", TissueElement::hexahedron, 4)) < 0.013);
  CHECK(std::abs(error_of("thick sphere 0.01 %, nu = 0.49", TissueElement::hexahedron, 4)) < 0.0125);
  CHECK(std::abs(error_of("thick sphere 30 %, nu = 0.49", TissueElement::hexahedron, 4)) < 0.038);
}

TEST_CASE("A ball pressed into hexahedra meets Hertz, and on a bonded layer Hayes et al., four cells over the contact") {
  CHECK(std::abs(error_of("Hertz, ball, nu = 0.3", TissueElement::hexahedron, 4)) < 0.0065);
  CHECK(std::abs(error_of("Hertz, ball, nu = 0.45", TissueElement::hexahedron, 4)) < 0.0065);
  CHECK(std::abs(error_of("layer, ball, nu = 0.49", TissueElement::hexahedron, 4)) < 0.0125);
}

TEST_CASE("A flat punch on a bonded layer converges to Hayes et al. in proportion to the size of the elements") {
  const double coarse = error_of("layer, punch, nu = 0.45", TissueElement::hexahedron, 4);
  const double fine = error_of("layer, punch, nu = 0.45", TissueElement::hexahedron, 8);
  INFO("too stiff by " << coarse << " and " << fine);
  CHECK(fine < 0.055);
  CHECK(order_of({4, 8}, {coarse, fine}) == Approx(1.2).margin(0.2));
}

TEST_CASE("Layers are compared with the numbers that bench/calculix/layer.py wrote") {
  std::ifstream file(std::string(PALPATE_SOURCE_DIR) + "/bench/calculix/layer.csv");
  std::string line;
  REQUIRE(std::getline(file, line));
  for (const LayerNumbers& numbers : kLayerNumbers) {
    REQUIRE(std::getline(file, line));
    std::istringstream fields(line);
    std::string kind, field;
    std::getline(fields, kind, ',');
    CHECK(kind == (numbers.is_ball ? "ball" : "punch"));
    for (const double expected : {numbers.a_over_h, numbers.poisson, numbers.depth, numbers.force}) {
      std::getline(fields, field, ',');
      CHECK(std::stod(field) == expected);
    }
  }
  CHECK_FALSE(std::getline(file, line));
}

TEST_CASE("Cook's membrane of hexahedra converges to the published and to CalculiX's displacement") {
  CHECK(std::abs(error_of("Cook, plane stress, nu = 1/3", TissueElement::hexahedron, 16)) < 0.02);
  CHECK(std::abs(error_of("Cook, plane strain, nu = 0.49", TissueElement::hexahedron, 16)) < 0.02);
}

TEST_CASE("Cases of FEBio's suite have their closed forms on one element") {
  for (const TissueCase& c : febio_cases()) {
    if (c.by != "closed form") continue;
    for (const TissueElement element : c.elements) CHECK(std::abs(c.solve(element, 1).value / c.reference - 1) < kExact);
  }
}

TEST_CASE("Blocks that meet share their nodes, and both elements fill them alike") {
  for (const BlockMesh& mesh :
       {cylinder(4, 0.01, 0.02), hollow_sphere_octant(4, 0.01, 0.02), layer_quarter(4, 0.01, 0.02, 0.05)}) {
    const LumpedBody hexahedra = mesh.body(SolidElement::hexahedron, soft(0.3)),
                     tetrahedra = mesh.body(SolidElement::tetrahedron, soft(0.3));
    CHECK(mass_of(hexahedra) == Approx(mass_of(tetrahedra)).epsilon(1e-12));
    CHECK(tetrahedra.tetrahedra.size() == 6 * hexahedra.hexahedra.size());
  }
  // A core of 4 x 4 cells and a ring of 2 x 16, 8 along.
  CHECK(cylinder(4, 0.01, 0.02).nodes().size() == (25 + 2 * 16) * 9);
  const double mass = mass_of(hollow_sphere_octant(6, 0.01, 0.02).body(SolidElement::hexahedron, soft(0.3)));
  CHECK(mass == Approx(1000 * pi / 6 * (8e-6 - 1e-6)).epsilon(0.01));
}

TEST_CASE("A body under a dead load is where its energy is stationary, and what holds it carries the load") {
  const LumpedBody body = box_mesh({2, 2, 4}, Vec3(0.02, 0.02, 0.04)).body(SolidElement::hexahedron, soft(0.45));
  BoundaryProblem problem(body);
  const auto low = nodes_where(body.nodes, [](const Vec3& x) { return x.z() < 1e-9; });
  const auto high = nodes_where(body.nodes, [](const Vec3& x) { return x.z() > 0.04 - 1e-9; });
  for (const std::uint32_t i : low) problem.hold(i, Vec3::Zero());
  const Vec3 load(0.05, 0, -0.1);
  for (const std::uint32_t i : high) problem.push(i, load / static_cast<double>(high.size()));
  problem.solve(2);
  Vec3 held = Vec3::Zero();
  for (const std::uint32_t i : low) held += problem.reaction(i);
  CHECK((held + load).norm() < 1e-6 * load.norm());
  for (const std::uint32_t i : high) CHECK(problem.reaction(i).norm() < 1e-6 * load.norm());
}

TEST_CASE("The order of errors is the slope of their logarithms, and that of exact answers is none") {
  CHECK(order_of({2, 4, 8}, {0.4, 0.1, 0.025}) == Approx(2));
  CHECK(std::isnan(order_of({2, 4}, {1e-12, 1e-13})));
  CHECK(std::isnan(order_of({2}, {0.1})));
}

TEST_CASE("Values are continued to no size along their order") {
  const auto value = [](double h) { return 3 + 5 * std::pow(h, kContactOrder); };
  const Continued exact = continue_to_no_size({1, 0.7, 0.5}, {value(1), value(0.7), value(0.5)}, kContactOrder);
  CHECK(exact.value == Approx(3));
  CHECK(exact.model_error < 1e-12);
  CHECK(continue_to_no_size({1, 0.7, 0.5}, {value(1), value(0.7) + 0.3, value(0.5)}, kContactOrder).model_error > 0.01);
}
