// A body's forces, tangents and matrix against finite differences of the forces.
#include "server/body/dynamics.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "server/scene/capsule.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/eigenvalues.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

LumpedBody body_of(SpringLaw law) {
  LumpedBody body = box_body(3, 3, 3);
  body.law = law;
  body.stiffening = 5;
  body.gravity_m_s2 = {0, 1, -9.81};
  return body;
}

LumpedBody solid_of(SolidLaw law) {
  LumpedBody body = solid_box(3, 3, 3, {law, 8e3, 0.4, 0.01});
  body.mass_damping_1_s = 3;
  body.gravity_m_s2 = {0, 1, -9.81};
  return body;
}

/// Bodies of springs of every law, of finite elements, and of both; of tetrahedra and hexahedra in a capsule.
LumpedBody any_body(int which) {
  if (which >= 6) {
    LumpedBody body = which == 6 ? solid_of(SolidLaw::neo_hookean) : hexa_box(3, 3, 3, {SolidLaw::neo_hookean, 8e3, 0.4, 0.01});
    body.mass_damping_1_s = 3;
    body.gravity_m_s2 = {0, 1, -9.81};
    add_capsule(body, {1e6, 2e-4, 0.3, 0.02});
    return body;
  }
  if (which < 3)
    return body_of(std::array{SpringLaw::linear, SpringLaw::stiffening, SpringLaw::thigh_skin}[static_cast<std::size_t>(which)]);
  LumpedBody body = solid_of(which == 3 ? SolidLaw::corotational : SolidLaw::neo_hookean);
  if (which == 5) body.elements = body_of(SpringLaw::linear).elements;
  return body;
}

Vector forces(const Dynamics& dynamics, const Vector& x, const Vector& v) {
  Vector f;
  dynamics.forces(x, v, f);
  return f;
}

Matrix dense_of(const BlockMatrix& a) {
  Vector y;
  return dense(3 * static_cast<Eigen::Index>(a.rows()), [&](const Vector& x) { return a.multiply(x, y), y; });
}

LumpedBody sheet() {
  LumpedBody body = box_body(4, 1, 3);
  for (Vec3& x : body.nodes) x = {x.x(), x.z(), 0};
  body.planar = true;
  body.triangles.clear();
  return body;
}

}  // namespace

TEST_CASE("Stiffness and damping of a body are the derivatives of its forces") {
  const LumpedBody body = any_body(GENERATE(range(0, 8)));
  const Dynamics dynamics(body);
  const BodyState s = random_state(dynamics, 3, 0.006, 0.3);
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    Vector y(s.x.size());
    for (double& value : y) value = random.uniform(-1, 1);
    // Short, as the skin's slope has a corner at rest, at the elements between fixed nodes.
    constexpr double kStepM = 1e-8, kStepMs = 1e-2;
    const Vector zero = Vector::Zero(y.size());  // the tangent omits the rotation of dampers
    const Vector k_y = (forces(dynamics, s.x - kStepM * y, zero) - forces(dynamics, s.x + kStepM * y, zero)) / (2 * kStepM);
    const Vector d_y = (forces(dynamics, s.x, s.v - kStepMs * y) - forces(dynamics, s.x, s.v + kStepMs * y)) / (2 * kStepMs);
    BodyState still{0, s.x, zero};
    Vector k, d;
    dynamics.multiply_tangents(still, y, k, d);
    CHECK((k - k_y).norm() < 1e-6 * k_y.norm());
    dynamics.multiply_tangents(s, y, k, d);
    CHECK((d - d_y).norm() < 1e-6 * d_y.norm());
  }
}

TEST_CASE("The assembled matrix is the sum of its parts, with identity rows and columns for held nodes") {
  const LumpedBody body = GENERATE(body_of(SpringLaw::stiffening), sheet(), any_body(3), any_body(5), any_body(6), any_body(7));
  const Dynamics dynamics(body);
  const BodyState s = random_state(dynamics, 5, 0.004, 0.3);
  const auto n = s.x.size();
  auto held = body.fixed;
  held.back() = 1;
  BlockMatrix a = dynamics.make_matrix();
  dynamics.assemble(s, 2, 0.3, 0.05, held, false, a);
  Matrix expected = 0.3 * dense_damping(dynamics, s) + 0.05 * dense_stiffness(dynamics, s);
  expected.diagonal() += 2 * dynamics.masses();
  for (Eigen::Index i = 0; i < n; ++i)
    if (held[static_cast<std::size_t>(i / 3)]) {
      expected.row(i).setZero();
      expected.col(i).setZero();
      expected(i, i) = 1;
    }
  CHECK((dense_of(a) - expected).norm() < 1e-13 * expected.norm());
  CHECK((dense_of(a) - dense_of(a).transpose()).norm() < 1e-15 * expected.norm());

  dynamics.assemble(s, 0, 0, 1, held, true, a);
  CHECK(test::symmetric_eigenvalues(dense_of(a))[0] > -1e-9);
}

TEST_CASE("A planar body has no stiffness and no damping across its plane") {
  const LumpedBody body = sheet();
  const Dynamics dynamics(body);
  const BodyState s = random_state(dynamics, 6, 0.004, 0.3);
  CHECK(s.x.allFinite());
  Vector across = Vector::Zero(s.x.size()), k, d;
  for (Eigen::Index i = 2; i < across.size(); i += 3) across[i] = static_cast<double>(i);
  dynamics.multiply_tangents(s, across, k, d);
  CHECK(k.norm() == 0);
  CHECK(d.norm() == 0);
  const Vector f = forces(dynamics, s.x, s.v);
  for (Eigen::Index i = 2; i < f.size(); i += 3) CHECK(f[i] == 0);
}

TEST_CASE("Internal forces have no sum and no moment, and a node's element force is its share") {
  LumpedBody body = any_body(GENERATE(range(2, 8)));
  body.mass_damping_1_s = 0;
  const Dynamics dynamics(body);
  const BodyState s = random_state(dynamics, 9, 0.006, 0.3);
  const Vector f = forces(dynamics, s.x, s.v);
  Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    const Vec3 internal = node_of(f, i) - body.masses_kg[i] * body.gravity_m_s2;
    CHECK((internal - dynamics.element_force(s, i)).norm() < 1e-12);
    sum += internal;
    moment += node_of(s.x, i).cross(internal);
  }
  CHECK(sum.norm() < 1e-12);
  CHECK(moment.norm() < 1e-13);
}

TEST_CASE("The forces without damping are minus the gradient of the energy") {
  const LumpedBody body = any_body(GENERATE(range(0, 6)));
  const Dynamics dynamics(body);
  BodyState s = random_state(dynamics, 10, 0.004, 0);
  const Vector f = forces(dynamics, s.x, s.v);
  for (const Eigen::Index i : {30, 41, 55, 62, 80}) {
    constexpr double kStepM = 1e-6;
    BodyState up = s, down = s;
    up.x[i] += kStepM;
    down.x[i] -= kStepM;
    CHECK((dynamics.energy(down) - dynamics.energy(up)) / (2 * kStepM) == Approx(f[i]).margin(2e-5 * f.norm()));
  }
}
