// Rigid parts that a tool meets: depth, friction, work around a path, and tools that begin inside.
#include "common/player/part_walls.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "common/base/random.hpp"
#include "tests/support/box_mesh.hpp"

using namespace palpate;

namespace {

constexpr double kStiffnessNM = 800, kMu = 0.4;

/// A box of 0.2 x 0.2 x 0.05 m, its top at z = 0.
PartWalls box(const ToolShape& tool = {}) {
  const TriangleMesh mesh = test::box_mesh(Vec3(-0.1, -0.1, -0.05), Vec3(0.1, 0.1, 0));
  const double friction = kMu;
  return PartWalls(std::span(&mesh, 1), std::span(&friction, 1), tool, kStiffnessNM);
}

}  // namespace

TEST_CASE("A point is pushed out by its depth, and only once it has been outside") {
  const PartWalls walls = box();
  WallTouches touches;
  CHECK(walls.push(Vec3(0, 0, -0.003), 1e9, touches).zero());
  CHECK(walls.push(Vec3(0, 0, 0.001), 1e9, touches).zero());
  const Wrench pushed = walls.push(Vec3(0.01, 0, -0.003), 1e9, touches);
  CHECK((pushed.force - Vec3(0, 0, kStiffnessNM * 0.003)).norm() < 1e-9);
  CHECK(pushed.torque.isZero(1e-12));
  CHECK(walls.push(Vec3(0.01, 0, -0.003), 100, touches).force.z() == Approx(0.3));  // of a device that bears no more
}

TEST_CASE("A sphere touches with its lowest point, and turns the tool about its tip") {
  const ToolSphere sphere{.centre = Vec3(0.02, 0, 0.03), .radius_m = 0.005};
  const PartWalls walls = box({sphere});
  WallTouches touches;
  const Rotation turn(Eigen::AngleAxisd(0.4, Vec3::UnitY()));
  const Vec3 arm = turn * sphere.centre;
  const auto at = [&](double height_m) { return ToolPose(Vec3(0, 0, height_m + 0.005) - Vec3(0, 0, arm.z()), turn); };
  CHECK(walls.push(at(0.0001), 1e9, touches).zero());
  const Wrench pushed = walls.push(at(-0.001), 1e9, touches);
  CHECK((pushed.force - Vec3(0, 0, kStiffnessNM * 0.001)).norm() < 1e-9);
  CHECK((pushed.torque - arm.cross(pushed.force)).norm() < 1e-12);
}

TEST_CASE("A tool sticks to a wall within the friction cone, and slides on its edge beyond") {
  const PartWalls walls = box();
  WallTouches touches;
  constexpr double kDepthM = 0.002;
  walls.push(Vec3(0, 0, 0.001), 1e9, touches);
  walls.push(Vec3(0, 0, -kDepthM), 1e9, touches);
  const double most_m = kMu * kDepthM;
  const Wrench sticks = walls.push(Vec3(0.5 * most_m, 0, -kDepthM), 1e9, touches);
  CHECK((sticks.force - kStiffnessNM * Vec3(-0.5 * most_m, 0, kDepthM)).norm() < 1e-9);
  const Wrench slides = walls.push(Vec3(0.03, 0, -kDepthM), 1e9, touches);
  CHECK((slides.force - kStiffnessNM * Vec3(-most_m, 0, kDepthM)).norm() < 1e-9);
  const Wrench back = walls.push(Vec3(0.03 - 2 * most_m, 0, -kDepthM), 1e9, touches);
  CHECK((back.force - kStiffnessNM * Vec3(most_m, 0, kDepthM)).norm() < 1e-9);
}

TEST_CASE("No path that ends where it began takes work out of a wall, and the force has no steps") {
  const PartWalls walls = box();
  for (const double tilt : {0.0, 0.5, 1.2}) {
    WallTouches touches;
    double work_j = 0, taken_j = 0;
    Vec3 at_before(0, 0, 0.004), force_before = Vec3::Zero();
    for (int k = 0; k <= 4000; ++k) {
      const double s = 6.283185307179586 * k / 1000;
      const Vec3 at(0.02 * std::sin(s), 0.01 * std::sin(2 * s + tilt), 0.004 * std::cos(s));
      const Vec3 force = walls.push(at, 1e9, touches).force;
      CHECK((force - force_before).norm() <= kStiffnessNM * (1 + 2 * kMu) * (at - at_before).norm() + 1e-9);
      work_j -= 0.5 * (force + force_before).dot(at - at_before);  // of the hand
      taken_j = std::min(taken_j, work_j);
      at_before = at;
      force_before = force;
      if (k % 1000 == 500) CHECK(force.z() == Approx(kStiffnessNM * 0.004));
    }
    CHECK(taken_j > -1e-6);
    CHECK(work_j > 1e-4);  // friction
  }
}

TEST_CASE("What a tool keeps from tick to tick changes no force") {
  TriangleMesh mesh = test::box_mesh(Vec3(-0.03, -0.02, -0.02), Vec3(0.02, 0.02, 0));
  const TriangleMesh other = test::box_mesh(Vec3(0, -0.01, -0.01), Vec3(0.03, 0.015, 0.01));  // which overlaps
  for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  const TriangleTree tree(mesh);
  const double friction = 0;
  for (const double radius_m : {0.0, 0.001, 0.006}) {
    const PartWalls walls(std::span(&mesh, 1), std::span(&friction, 1), {{.centre = Vec3::Zero(), .radius_m = radius_m}},
                          kStiffnessNM);
    WallTouches touches;
    Random random(7);
    Vec3 at(0, 0, 0.05);
    int pushed = 0, inside = 0;
    for (int k = 0; k < 20000; ++k) {
      const double step_m = k % 500 == 499 ? 0.03 : 0.0006;
      for (Eigen::Index i = 0; i < 3; ++i) at[i] = std::clamp(at[i] + step_m * (2 * random.uniform() - 1), -0.045, 0.045);
      const bool within = tree.winding_number(at) > 0.5;
      const Vec3 away = (within ? -1 : 1) * (at - tree.nearest(at));
      const double depth_m = radius_m + (within ? 1 : -1) * away.norm();
      const Vec3 expected = depth_m > 0 ? Vec3(kStiffnessNM * depth_m * away.normalized()) : Vec3::Zero();
      CHECK((walls.push(at, 1e9, touches).force - expected).norm() < 1e-9);
      pushed += depth_m > 0;
      inside += within;
    }
    CHECK(pushed > 1000);
    CHECK(inside > 1000);
  }
}
