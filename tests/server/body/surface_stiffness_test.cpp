// The reported stiffness of an untouched body, against a dense solve and against its mesh.
#include "server/body/surface_stiffness.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numeric>

#include "server/body/skin.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// 1 / (n^T B^T K^-1 B n) with K of the free nodes as a dense matrix.
double dense_finger_stiffness(const Scene& scene, const NodeWeights& weights, const Vec3& direction) {
  const Dynamics dynamics(scene.body);
  Matrix k = dense_stiffness(dynamics, dynamics.rest_state());
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    if (!scene.body.fixed[i]) continue;
    for (Eigen::Index c = 3 * static_cast<Eigen::Index>(i); c < 3 * static_cast<Eigen::Index>(i) + 3; ++c) {
      k.row(c).setZero();
      k.col(c).setZero();
      k(c, c) = 1;
    }
  }
  Vector push = Vector::Zero(k.rows());
  scatter(weights, direction, push);
  return 1 / push.dot(Vector(k.ldlt().solve(push)));
}

}  // namespace

TEST_CASE("The stiffness under a finger is that of a dense solve, for points and for wide tips, springs and tetrahedra") {
  for (const bool solid : {false, true})
    for (const double radius_m : {0.0, 0.03}) {
      Scene scene = box_scene(ContactKind::touch);
      if (solid) scene.body = solid_box(4, 4, 4, {});
      scene.tool.radius_m = radius_m;
      const Vec3 tool(0.031, 0.027, 0.09);
      const auto finger = finger_stiffness(scene, tool);
      REQUIRE(finger);
      CHECK((finger->place - Vec3(0.031, 0.027, 0.06)).norm() < 1e-9);
      const Skin skin(scene.body, radius_m);
      const SurfacePoint point = nearest_point(skin.view(), skin.rest(), tool).point;
      CHECK(finger->stiffness_n_m == Approx(dense_finger_stiffness(scene, skin.weights(point), finger->outward)).epsilon(1e-4));
    }
}

TEST_CASE("Of a grasp it is that of the node, and a body that is not held has none") {
  Scene scene = box_scene(ContactKind::attach);
  const auto finger = finger_stiffness(scene, Vec3::Zero());
  REQUIRE(finger);
  CHECK(finger->stiffness_n_m == Approx(dense_finger_stiffness(scene, {{54, 1.0}}, Vec3::UnitZ())).epsilon(1e-4));
  scene.body.fixed.assign(scene.body.nodes.size(), 0);
  CHECK_FALSE(finger_stiffness(scene, Vec3::Zero()));
}

TEST_CASE("The organ of tetrahedra weighs its density times the volume inside of its surface") {
  const LumpedBody body = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/organ-solid.json").body;
  double volume_m3 = 0;
  for (const Triangle& t : body.triangles) volume_m3 += body.nodes[t[0]].dot(body.nodes[t[1]].cross(body.nodes[t[2]])) / 6;
  CHECK(std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0) == Approx(1060 * volume_m3).epsilon(1e-9));
}
