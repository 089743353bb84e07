#include "common/base/tool_shape.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace palpate;

namespace {

const ToolSphere kFixed{Vec3(0.01, 0.002, 0.003), 0.003}, kRight{Vec3(0.004, 0.001, 0.002), 0.003, 0.04, 0.5},
    kLeft{Vec3(-0.004, 0.001, 0.002), 0.003, 0.04, -0.5}, kCrossing{Vec3(0.001, 0, 0.002), 0, 0, 0, 0.03};

Rotation tilted() { return Rotation(Eigen::AngleAxisd(0.7, Vec3(1, -2, 2) / 3)); }

}  // namespace

TEST_CASE(
    "A sphere of a jaw turns about the hinge by its share of the swing, its tip to its own side, a crossing slides, and others "
    "stay") {
  const double opening = 0.6;
  const Vec3 hinge(0, 0, 0.04);
  for (const ToolSphere& sphere : {kRight, kLeft}) {
    const Vec3 turned = hinge + Eigen::AngleAxisd(-opening * sphere.swing_rad, Vec3::UnitY()) * Vec3(sphere.centre - hinge);
    CHECK((sphere.centre_at(opening) - turned).norm() < 1e-15);
    CHECK(sphere.centre_at(opening).x() * sphere.swing_rad > 0.5 * opening * std::abs(sphere.swing_rad) * 0.036);
    CHECK((sphere.centre_at(0) - sphere.centre).norm() < 1e-15);
  }
  CHECK(kFixed.centre_at(opening) == kFixed.centre);
  CHECK((kCrossing.centre_at(opening) - Vec3(0.001, 0, 0.02)).norm() < 1e-15);
  CHECK(kRight.centre_at(opening).x() == Approx(-kLeft.centre_at(opening).x()));
  CHECK(has_jaws({kFixed, kLeft}));
  CHECK(has_jaws({kCrossing}));
  CHECK_FALSE(has_jaws({kFixed}));
}

TEST_CASE("The velocity of a sphere by the opening, and the force of a contact on it, are those of finite differences") {
  const double opening = 0.3, step = 1e-6;
  const Vec3 force(1.2, -0.4, 0.7);
  for (const ToolSphere& sphere : {kRight, kLeft, kCrossing, kFixed}) {
    const Vec3 swept = (sphere.centre_at(opening + step) - sphere.centre_at(opening - step)) / (2 * step);
    CHECK((sphere.swept(opening) - swept).norm() < 1e-9);
    // A point of the sphere, which moves with its jaw.
    const Vec3 beside(0.001, -0.002, 0.0015);
    ToolSphere point = sphere;
    point.centre += beside;
    const auto arm = [&](double o) { return ToolPose(Vec3::Zero(), tilted(), o).arm_of(point); };
    const double work = force.dot(arm(opening + step) - arm(opening - step)) / (2 * step);
    CHECK(grip_of(sphere, tilted(), arm(opening), force) == Approx(work).margin(1e-9));
  }
}

TEST_CASE("Between two poses the opening changes evenly") {
  const ToolPose from(Vec3::Zero(), Rotation::Identity(), 0.2), to(Vec3(0, 0, 1), tilted(), 0.6);
  CHECK(pose_between(from, to, 0.25).opening == Approx(0.3));
}
