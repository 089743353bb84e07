// Location of reduced states and decay of stress, against hand-made states and the laws of elasticity.
#include "bench/paper/locality.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "bench/paper/balance.hpp"

namespace palpate {
namespace {

/// A state in which a single coordinate is displaced and another one moves.
Matrix one_state(const SecondOrderSystem& system, Eigen::Index displaced, Eigen::Index moving, double speed) {
  Matrix d = Matrix::Zero(2 * system.size(), 1);
  d(displaced, 0) = 1;
  d(system.size() + moving, 0) = speed;
  return d;
}

TEST_CASE("A state of one node's displacement has the energy of that node's springs and no other", "[paper]") {
  const Specimen sheet = Specimen::sheet(9, {});
  const SecondOrderSystem system = sheet.system();
  // A coordinate far from the port, in a corner of the sheet.
  const std::uint32_t node = system.coordinates.front() / 3;
  const double away = (sheet.body().nodes[node] - sheet.body().nodes[sheet.port_node()]).norm(), cell = kSpecimenSizeM / 8;
  const auto shapes = state_shapes(sheet, system, one_state(system, 0, 0, 0), {away - cell, away + cell});
  CHECK(shapes[0].share_within[0] == 0);
  CHECK(shapes[0].share_within[1] == Approx(1).epsilon(1e-12));
  CHECK(shapes[0].displacement[node] == 1);
  CHECK(shapes[0].velocity[node] == 0);
}

TEST_CASE("Energies of displacement and motion add up as k/2 u^2 and m/2 v^2", "[paper]") {
  const Specimen sheet = Specimen::sheet(9, {100, 0.5, 0.001});
  const SecondOrderSystem system = sheet.system();
  const Eigen::Index last = system.size() - 1;
  const double speed = 100, kinetic = 0.5 * 0.001 * speed * speed, elastic = 0.5 * system.stiffness.coeff(0, 0);
  const Vec3 port = sheet.body().nodes[sheet.port_node()];
  const double near = (sheet.body().nodes[system.coordinates.back() / 3] - port).norm();
  const auto shapes = state_shapes(sheet, system, one_state(system, 0, last, speed), {near * 1.001, 1});
  CHECK(shapes[0].share_within[0] == Approx(kinetic / (kinetic + elastic)).epsilon(1e-9));
  CHECK(shapes[0].share_within[1] == Approx(1).epsilon(1e-12));
}

TEST_CASE("The reduced states of the sheet are local: more of their energy is near than spread evenly", "[paper]") {
  const Specimen sheet = Specimen::sheet(kPaperNodes, {});
  const SecondOrderSystem system = sheet.system();
  const std::vector<double> radii{0.025, 0.05, 1};
  const auto shapes = state_shapes(sheet, system, BalancedReduction(system).directions(10), radii);
  const auto even = even_share(sheet, radii);
  CHECK(even[2] == Approx(1).epsilon(1e-12));
  REQUIRE(shapes.size() == 10);
  for (const StateShape& s : shapes) {
    CHECK(s.share_within[0] > even[0]);
    CHECK(s.share_within[1] > even[1]);
  }
}

TEST_CASE("The exponent of a power law is found exactly", "[paper]") {
  std::vector<StressAt> line;
  for (const double depth : {0.01, 0.02, 0.03, 0.04}) line.push_back({depth, 5 * std::pow(depth, -1.7)});
  CHECK(decay_exponent(line, 0.01, 0.04) == Approx(1.7).epsilon(1e-12));
}

TEST_CASE("Stress falls as 1/r below a load on a sheet (Flamant) and faster, towards 1/r^2, in a cube (Boussinesq)", "[paper]") {
  const double sheet = decay_exponent(stress_below_port(Specimen::sheet(25, {})), 0.008, 0.03);
  const double cube = decay_exponent(stress_below_port(Specimen::cube(10, {})), 0.01, 0.035);
  CHECK(sheet == Approx(1).margin(0.1));
  CHECK(cube > 1.5);
  CHECK(cube < 2.1);
}

TEST_CASE("Under a static push the stress below the instrument falls from node to node", "[paper]") {
  const auto line = stress_below_port(Specimen::sheet(kPaperNodes, {}));
  REQUIRE(line.size() == 11);
  for (std::size_t i = 1; i < line.size(); ++i) CHECK(line[i].stress < line[i - 1].stress);
}

}  // namespace
}  // namespace palpate
