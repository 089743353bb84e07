// The signed distance of a part against planes and spheres.
#include "server/scene/distance_grid.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/random.hpp"

using namespace palpate;

TEST_CASE("A plane is exact on a grid that is turned against it, and a sphere is too small by h^2 / 4 r") {
  const Mat3 turned = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const Vec3 origin(0.3, -0.2, 0.1), half = Vec3::Constant(0.05), n = Vec3(0.2, -0.4, 1).normalized();
  const DistanceGrid plane(turned, origin, -half, half, 4000, [&](const Vec3& p) { return n.dot(p - origin); });
  constexpr double kRadiusM = 0.04;
  const DistanceGrid sphere(turned, origin, -half, half, 4000, [&](const Vec3& p) { return (p - origin).norm() - kRadiusM; });
  const double h = sphere.spacing_m().x();
  Random random(1);
  for (int k = 0; k < 200; ++k) {
    const Vec3 direction = Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)).normalized();
    const Vec3 p = origin + random.uniform(0.03, 0.05) * direction;
    const auto on_plane = plane.at(p), on_sphere = sphere.at(p);
    REQUIRE((on_plane && on_sphere));
    CHECK(on_plane->distance_m == Approx(n.dot(p - origin)).margin(1e-8));
    CHECK((on_plane->gradient - n).norm() < 1e-5);
    const double r = (p - origin).norm();
    CHECK(on_sphere->distance_m - (r - kRadiusM) == Approx(h * h / (4 * r)).epsilon(0.15));
    CHECK((on_sphere->gradient - direction).norm() < 0.02);
  }
  CHECK_FALSE(plane.at(origin + Vec3(0.2, 0, 0)));
}

TEST_CASE("The gradient is that of the distance, and has no steps from cell to cell") {
  const DistanceGrid sphere(Mat3::Identity(), Vec3::Zero(), Vec3::Constant(-0.05), Vec3::Constant(0.05), 1000,
                            [](const Vec3& p) { return p.norm() - 0.04; });
  constexpr double kStepM = 1e-5;
  const Vec3 along = Vec3(1, 0.3, -0.2).normalized();
  auto before = sphere.at(Vec3(-0.04, 0.01, 0.02));
  REQUIRE(before);
  for (double s = kStepM; s < 0.08; s += kStepM) {
    const auto now = sphere.at(Vec3(-0.04, 0.01, 0.02) + s * along);
    REQUIRE(now);
    CHECK((now->gradient - before->gradient).norm() < 2 * kStepM / 0.01);
    CHECK((now->distance_m - before->distance_m) / kStepM ==
          Approx(0.5 * (now->gradient + before->gradient).dot(along)).margin(1e-3));
    before = now;
  }
}
