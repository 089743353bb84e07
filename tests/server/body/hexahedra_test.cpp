// Bodies of hexahedra: forces, energy and tangents of the whole, and accuracy against the continuum with few cells.
#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "server/body/locking.hpp"
#include "server/body/settle.hpp"
#include "server/body/tangents.hpp"
#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/hanging_bar.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

const SolidMaterial kSoft{SolidLaw::neo_hookean, 5e3, 0.45, 0.02};

/// Cells of many shapes: every node is moved a little.
LumpedBody crooked_box(int nx, int ny, int nz, const SolidMaterial& material) {
  LumpedBody body = hexa_box(nx, ny, nz, material);
  Random random(12);
  for (Vec3& x : body.nodes) x += random_vector(random, 0.1 * kSpacingM);
  return body;
}

Vector forces_of(const Dynamics& dynamics, const Vector& x, const Vector& v) {
  Vector f;
  dynamics.forces(x, v, f);
  return f;
}

/// Sag of hanging_bar.hpp, with 400 kPa.
double sag_mm(const std::string& nodes, double poisson, const std::string& element) {
  return hanging_bar_sag_mm(
      nodes, R"("solid": {"element": ")" + element + R"(", "young_pa": 400000, "poisson": )" + std::to_string(poisson) + "}");
}

/// Force [N] on a square of 20 x 20 mm that is glued to the top of a block of 60 x 60 x 30 mm, bonded below, and pressed in by 3
/// mm.
double punch_n(const std::string& nodes, double poisson, const std::string& element) {
  Scene scene = read_scene(R"({"body": {"lattice": {"nodes": )" + nodes +
                               R"(, "size_m": [0.06, 0.06, 0.03], "fixed_faces": ["z-"],
      "solid": {"element": ")" +
                               element + R"(", "young_pa": 10000, "poisson": )" + std::to_string(poisson) + "}}}}",
                           "block.json");
  std::vector<std::uint32_t> pressed;
  for (std::uint32_t i = 0; i < scene.body.nodes.size(); ++i) {
    const Vec3& x = scene.body.nodes[i];
    if (x.z() < 0.03 - 1e-9 || std::abs(x.x() - 0.03) > 0.01 + 1e-9 || std::abs(x.y() - 0.03) > 0.01 + 1e-9) continue;
    pressed.push_back(i);
    scene.body.fixed[i] = 1;
  }
  const Dynamics dynamics(scene.body);
  BodyState from = dynamics.rest_state();
  for (const std::uint32_t i : pressed) from.x[3 * static_cast<Eigen::Index>(i) + 2] -= 0.003;
  const Equilibrium still = find_equilibrium(dynamics, from);
  REQUIRE(still.found);
  double force_n = 0;
  for (const std::uint32_t i : pressed) force_n += dynamics.element_force(still.state, i).z();
  return force_n;
}

/// Tip displacement of Cook's membrane, plane stress, for unit modulus, thickness and load, by linear statics at rest.
double cook(int cells) {
  LumpedBody body = hexa_box(cells + 1, cells + 1, 2, {SolidLaw::neo_hookean, 1, 1.0 / 3, 0});
  for (Vec3& x : body.nodes) {
    const double s = x.x() / kSpacingM / cells, t = x.y() / kSpacingM / cells;
    x = Vec3(48 * s, 44 * s + t * (44 - 28 * s), x.z() / kSpacingM - 0.5);
  }
  const Dynamics dynamics(body);
  std::vector<int> free;
  Vector load = Vector::Zero(3 * dynamics.nodes());
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    const auto at = static_cast<Eigen::Index>(3 * i);
    if (body.nodes[i].x() < 1e-9) continue;
    for (int axis = 0; axis < 3; ++axis) free.push_back(static_cast<int>(at) + axis);
    const double y = body.nodes[i].y();
    if (body.nodes[i].x() > 48 - 1e-9) load[at + 1] = (y < 44 + 1e-9 || y > 60 - 1e-9 ? 0.5 : 1.0) / cells / 2;
  }
  BlockMatrix k = dynamics.make_matrix();
  dynamics.assemble(dynamics.rest_state(), 0, 0, 1, std::vector<std::uint8_t>(dynamics.nodes(), 0), false, k);
  std::vector<int> place(static_cast<std::size_t>(load.size()), -1);
  for (std::size_t n = 0; n < free.size(); ++n) place[static_cast<std::size_t>(free[n])] = static_cast<int>(n);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::uint32_t row = 0; row < k.rows(); ++row)
    for (std::uint32_t e = k.row_begin(row); e < k.row_end(row); ++e)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const int p = place[3 * row + static_cast<unsigned>(i)], q = place[3 * k.column(e) + static_cast<unsigned>(j)];
          if (p >= 0 && q >= 0) entries.emplace_back(p, q, k.block(e)(i, j));
        }
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(free.size()), static_cast<Eigen::Index>(free.size()));
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Vector u = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(Vector(load(free)));
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if ((body.nodes[i] - Vec3(48, 52, 0.5)).norm() < 1e-9) return u[place[3 * i + 1]];
  FAIL("no node there");
  return 0;
}

}  // namespace

TEST_CASE("The forces of a body of hexahedra are minus the gradient of its energy", "[body][hexa]") {
  LumpedBody body = crooked_box(4, 3, 3, kSoft);
  body.gravity_m_s2 = {1, 2, -3};
  const Dynamics dynamics(body);
  const BodyState s = random_state(dynamics, 3, 0.2 * kSpacingM, 0);
  const Vector f = forces_of(dynamics, s.x, s.v), direction = random_state(dynamics, 4, 1, 0).x;
  const double h = 1e-7;
  BodyState there = s, back = s;
  there.x += h * direction;
  back.x -= h * direction;
  const double slope = (dynamics.energy(there) - dynamics.energy(back)) / (2 * h);
  CHECK(slope == Approx(-f.dot(direction)).epsilon(1e-6));
  for (const std::uint32_t node : {0U, 13U, 35U})
    CHECK((dynamics.element_force(s, node) - node_of(f, node) + body.masses_kg[node] * body.gravity_m_s2).norm() <
          1e-10 * f.norm());
}

TEST_CASE("The tangents of a body of hexahedra are the derivatives of its forces, put together or not", "[body][hexa]") {
  LumpedBody body = crooked_box(4, 3, 3, kSoft);
  body.mass_damping_1_s = 3;
  const Dynamics dynamics(body);
  const BodyState s = random_state(dynamics, 5, 0.2 * kSpacingM, 0.1);
  const Matrix k = dense_stiffness(dynamics, s), d = dense_damping(dynamics, s);
  const Vector direction = random_state(dynamics, 6, 1, 0).x;
  const double h = 1e-7;
  const Vector still = Vector::Zero(s.x.size());
  const Vector slope =
      (forces_of(dynamics, s.x + h * direction, still) - forces_of(dynamics, s.x - h * direction, still)) / (2 * h);
  CHECK((k * direction + slope).norm() < 1e-6 * slope.norm());
  const Vector braked = forces_of(dynamics, s.x, s.v + direction) - forces_of(dynamics, s.x, s.v);
  CHECK((d * direction + braked).norm() < 1e-9 * braked.norm());
  CHECK((k - k.transpose()).norm() < 1e-12 * k.norm());

  const std::vector<std::uint8_t> none(dynamics.nodes(), 0);
  BlockMatrix a = dynamics.make_matrix();
  dynamics.assemble(s, 0, 0.3, 0.7, none, false, a);
  Vector product;
  a.multiply(direction, product);
  CHECK((product - (0.3 * d + 0.7 * k) * direction).norm() < 1e-10 * product.norm());

  Tangents tangents(dynamics);
  tangents.take(s);
  Matrix y(s.x.size(), 2), k_y, d_y, sum;
  y << direction, s.v;
  k_y = d_y = Matrix::Zero(y.rows(), y.cols());
  tangents.multiply(y, k_y, d_y);
  CHECK((k_y - k * y).norm() < 1e-12 * k_y.norm());
  CHECK((d_y - d * y).norm() < 1e-12 * d_y.norm());
  tangents.multiply_sum(y, 0.7, 0.3, sum);
  CHECK((sum - 0.7 * k_y - 0.3 * d_y).norm() < 1e-12 * sum.norm());
}

TEST_CASE("Under an affine motion no node inside a body of crooked hexahedra is pushed", "[body][hexa]") {
  const LumpedBody body = crooked_box(4, 4, 4, kSoft);
  const Dynamics dynamics(body);
  const Mat3 f = (Mat3() << 1.2, 0.3, -0.1, 0.1, 0.8, 0.2, -0.2, 0.1, 1.1).finished();
  Vector x = dynamics.rest_state().x;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) at_node(x, i) = f * body.nodes[i];
  const Vector forces = forces_of(dynamics, x, Vector::Zero(x.size()));
  double inside = 0, outside = 0;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    const std::uint32_t a = i % 4, b = i / 4 % 4, c = i / 16;
    const bool is_inside = a % 3 != 0 && b % 3 != 0 && c % 3 != 0;
    (is_inside ? inside : outside) += node_of(forces, i).norm();
  }
  CHECK(inside < 1e-11 * outside);
}

TEST_CASE("Left to itself, a body of hexahedra keeps its momentum and angular momentum", "[body][hexa]") {
  LumpedBody body = crooked_box(3, 3, 3, kSoft);
  body.fixed.assign(body.nodes.size(), 0);
  const Dynamics dynamics(body);
  BodyState s = random_state(dynamics, 7, 0.1 * kSpacingM, 0.3);
  const auto momenta = [&] {
    Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
      const Vec3 p = body.masses_kg[i] * node_of(s.v, i);
      sum.head<3>() += p;
      sum.tail<3>() += node_of(s.x, i).cross(p);
    }
    return sum;
  };
  const auto before = momenta();
  const double energy = dynamics.energy(s);
  Integrator integrator(dynamics, Skin(), {0.001});
  std::vector<ToolPort> none;
  for (int k = 0; k < 40; ++k) REQUIRE(integrator.advance(s, none, s.time_s + 0.001, {}).converged);
  CHECK((momenta() - before).head<3>().norm() < 1e-7 * before.head<3>().norm());
  CHECK((momenta() - before).tail<3>().norm() < 1e-2 * before.tail<3>().norm());
  CHECK(dynamics.energy(s) < energy);
}

TEST_CASE("A hanging bar of hexahedra is as soft as the continuum, four cells high, whatever its Poisson's ratio",
          "[body][hexa]") {
  // bench/calculix: quadratic elements of CalculiX, 24 x 8 x 6.
  struct Bar {
    double poisson, sag_mm;
  };
  for (const Bar& bar : {Bar{0.3, 9.36}, Bar{0.45, 9.07}, Bar{0.49, 8.93}, Bar{0.499, 8.86}})
    CHECK(sag_mm("[21, 7, 5]", bar.poisson, "hexahedron") == Approx(bar.sag_mm).epsilon(0.03));
  CHECK(sag_mm("[21, 7, 5]", 0.499, "tetrahedron") < 0.2 * 8.86);
}

TEST_CASE("A punch into a bonded block of hexahedra meets less force than quadratic elements with nodes as far apart have",
          "[body][hexa]") {
  // bench/calculix: 3 x 3 x 3, and the limit of finer ones.
  struct Block {
    double poisson, force_n, least_n;
  };
  for (const Block& block : {Block{0.45, 1.439, 1.28}, Block{0.49, 1.599, 1.38}, Block{0.499, 1.720, 1.41}}) {
    const double force_n = punch_n("[13, 13, 7]", block.poisson, "hexahedron");
    CHECK(force_n < block.force_n);
    CHECK(force_n > block.least_n);
  }
}

TEST_CASE("What locking is expected of a bar of tetrahedra is about what it has", "[body][tetra]") {
  const auto expected = [](const std::string& nodes, double poisson) {
    const LumpedBody body = read_scene(R"({"body": {"lattice": {"nodes": )" + nodes +
                                           R"(, "size_m": [0.1, 0.03, 0.02], "fixed_faces": ["x-"],
      "solid": {"element": "tetrahedron", "young_pa": 400000, "poisson": )" +
                                           std::to_string(poisson) + "}}}}",
                                       "bar.json")
                                .body;
    return expected_locking(body);
  };
  CHECK(expected("[21, 7, 5]", 0.3) == Approx(9.36 / sag_mm("[21, 7, 5]", 0.3, "tetrahedron") - 1).epsilon(0.35));
  CHECK(expected("[21, 7, 5]", 0.45) == Approx(9.07 / sag_mm("[21, 7, 5]", 0.45, "tetrahedron") - 1).epsilon(0.35));
  CHECK(expected("[21, 7, 5]", 0.49) == Approx(8.93 / sag_mm("[21, 7, 5]", 0.49, "tetrahedron") - 1).epsilon(0.35));
  CHECK(expected_locking(hexa_box(3, 3, 3, kSoft)) == 0);
}

TEST_CASE("Cook's membrane of crooked hexahedra converges to the known displacement", "[body][hexa]") {
  constexpr double kReference = 23.96;  // plane stress, nu = 1/3
  CHECK(cook(8) == Approx(kReference).epsilon(0.03));
  CHECK(cook(16) == Approx(kReference).epsilon(0.01));
}
