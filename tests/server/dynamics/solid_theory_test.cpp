// Bodies of finite elements against the theory of elasticity: a beam in bending, a ball pressed into a half-space, and a falling
// clump whose elements must have no effect.
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

using Sparse = Eigen::SparseMatrix<double>;

Sparse stiffness_at_rest(const Dynamics& dynamics) {
  BlockMatrix k = dynamics.make_matrix();
  dynamics.assemble(dynamics.rest_state(), 0, 0, 1, std::vector<std::uint8_t>(dynamics.nodes(), 0), false, k);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::uint32_t row = 0; row < k.rows(); ++row)
    for (std::uint32_t e = k.row_begin(row); e < k.row_end(row); ++e)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) entries.emplace_back(3 * row + i, 3 * k.column(e) + j, k.block(e)(i, j));
  const auto n = 3 * static_cast<Eigen::Index>(k.rows());
  Sparse matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Displacements under prescribed components (finite in `given`) and forces on the others.
Vector solve_static(const Dynamics& dynamics, const Vector& given, const Vector& force) {
  const Sparse k = stiffness_at_rest(dynamics);
  std::vector<int> free;
  Vector u = Vector::Zero(given.size());
  for (Eigen::Index i = 0; i < given.size(); ++i) {
    if (std::isfinite(given[i]))
      u[i] = given[i];
    else
      free.push_back(static_cast<int>(i));
  }
  const auto m = static_cast<Eigen::Index>(free.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < m; ++i) entries.emplace_back(free[static_cast<std::size_t>(i)], i, 1.0);
  Sparse choose(given.size(), m);
  choose.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> ldlt(Sparse(choose.transpose() * k * choose));
  u += choose * ldlt.solve(Vector(choose.transpose() * (force - k * u)));
  return u;
}

constexpr double kFree = std::numeric_limits<double>::quiet_NaN();

/// Stiffness at the tip of a cantilever of square section with `across` cells over its height, over that of Timoshenko's beam.
double cantilever_over_theory(int across) {
  constexpr double kLengthM = 0.08, kHeightM = 0.02, kYoungPa = 1e4, kForceN = 1e-3;
  const int along = 4 * across;
  LumpedBody body = solid_box(along + 1, across + 1, across + 1, {SolidLaw::neo_hookean, kYoungPa, 0, 0});
  for (Vec3& x : body.nodes) x *= kHeightM / across / kSpacingM;
  const Dynamics dynamics(body);
  Vector given = Vector::Constant(3 * dynamics.nodes(), kFree), force = Vector::Zero(given.size());
  int tip_nodes = 0;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    if (body.nodes[i].x() < 1e-9) at_node(given, i).setZero();
    tip_nodes += body.nodes[i].x() > kLengthM - 1e-9;
  }
  double deflection = 0;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (body.nodes[i].x() > kLengthM - 1e-9) force[3 * i + 2] = kForceN / tip_nodes;
  const Vector u = solve_static(dynamics, given, force);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (body.nodes[i].x() > kLengthM - 1e-9) deflection += u[3 * i + 2] / tip_nodes;
  const double area = kHeightM * kHeightM, inertia = area * area / 12, shear_pa = kYoungPa / 2;
  return kForceN * (std::pow(kLengthM, 3) / (3 * kYoungPa * inertia) + kLengthM / (5.0 / 6 * shear_pa * area)) / deflection;
}

/// Force on a ball over that of Hertz, with `cells` across the radius of the contact. A quarter of the half-space; cells grow
/// with the distance.
double ball_over_hertz(int cells) {
  constexpr int kCells = 15, kEven = 7;
  constexpr double kCellM = 1e-3, kGrowth = 1.5, kYoungPa = 1e4, kPoisson = 0.3, kBallM = 0.2;
  LumpedBody body = solid_box(kCells + 1, kCells + 1, kCells + 1, {SolidLaw::corotational, kYoungPa, kPoisson, 0});
  const auto graded = [&](double n) {
    if (n <= kEven) return n * kCellM;
    return kCellM * (kEven + kGrowth * (std::pow(kGrowth, n - kEven) - 1) / (kGrowth - 1));
  };
  for (Vec3& x : body.nodes) x = (x / kSpacingM).unaryExpr([&](double c) { return graded(std::round(c)); });
  const double size = graded(kCells), contact = cells * kCellM, depth = contact * contact / kBallM;
  const Dynamics dynamics(body);
  Vector given = Vector::Constant(3 * dynamics.nodes(), kFree);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    const Vec3 x = body.nodes[i];  // z is the depth
    const double r = x.head<2>().norm();
    for (int axis = 0; axis < 3; ++axis)
      if (x[axis] > size - 1e-9 || (axis < 2 && x[axis] < 1e-9)) given[3 * i + axis] = 0;
    if (x.z() < 1e-9 && r <= contact + 1e-9) given[3 * i + 2] = depth - r * r / (2 * kBallM);
  }
  const Vector f = stiffness_at_rest(dynamics) * solve_static(dynamics, given, Vector::Zero(given.size()));
  double force = 0;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (body.nodes[i].z() < 1e-9 && std::isfinite(given[3 * i + 2])) force += 4 * f[3 * i + 2];
  return force / (4.0 / 3 * kYoungPa / (1 - kPoisson * kPoisson) * std::sqrt(kBallM) * std::pow(depth, 1.5));
}

}  // namespace

TEST_CASE("A cantilever of tetrahedra bends as Timoshenko's beam, with an error of second order in their size") {
  const double coarse = cantilever_over_theory(2) - 1, fine = cantilever_over_theory(4) - 1;
  INFO("too stiff by " << coarse << " and " << fine);
  CHECK(coarse / fine == Approx(4).margin(0.4));
  CHECK((4 * fine - coarse) / 3 == Approx(0).margin(0.02));  // extrapolated to zero size
}

TEST_CASE("A ball pressed into a half-space of tetrahedra meets the force that Hertz found") {
  // Too stiff by 11 %, a third of which is due to the finite block; 8 % with 20 cells a side that grow by a quarter.
  CHECK(ball_over_hertz(6) == Approx(1).margin(0.12));
}

TEST_CASE("A free body of tetrahedra that falls and turns keeps its momenta and loses no energy but by its viscosity") {
  for (const SolidLaw law : {SolidLaw::corotational, SolidLaw::neo_hookean}) {
    LumpedBody body = solid_box(3, 3, 3, {law, 5e3, 0.4, 0});
    body.fixed.assign(body.nodes.size(), 0);
    const Dynamics dynamics(body);
    const Skin skin;
    Integrator integrator(dynamics, skin, {});
    BodyState s = dynamics.rest_state();
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) at_node(s.v, i) = Vec3(0, 3, 5).cross(body.nodes[i]) + Vec3(0.1, 0, 0);
    const auto momentum = [&] {
      Eigen::Matrix<double, 6, 1> p = Eigen::Matrix<double, 6, 1>::Zero();
      for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
        const Vec3 mv = body.masses_kg[i] * at_node(s.v, i), x = at_node(s.x, i);
        p.head<3>() += mv;
        p.tail<3>() += x.cross(mv);
      }
      return p;
    };
    const auto before = momentum();
    const double energy = dynamics.energy(s);
    std::vector<ToolPort> none;
    const auto report = integrator.advance(s, none, 0.5, 1e-3, [](std::size_t, double) { return ToolAt{}; });
    CHECK(report.converged);
    CHECK((momentum() - before).head<3>().norm() < 1e-6 * before.head<3>().norm());
    CHECK((momentum() - before).tail<3>().norm() <
          2e-3 * before.tail<3>().norm());  // error of the integrator, second order in its step
    CHECK(dynamics.energy(s) / energy == Approx(1).margin(0.02));
    CHECK(dynamics.energy(s) < 1.001 * energy);
  }
}
