#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>

#include "client/view/solids.hpp"

using namespace palpate;

namespace {

constexpr float kTipM = 0.002F;

SolidMesh stylus(const std::optional<Eigen::Matrix3f>& axes, bool pressed) {
  SolidMesh mesh;
  append_stylus(mesh, {Vec3f(1, 2, 3), kTipM, Vec3f(1, 0, 0), axes, pressed});
  return mesh;
}

Eigen::Matrix3f turned(float angle, const Vec3f& about) { return Eigen::AngleAxisf(angle, about).toRotationMatrix(); }

}  // namespace

TEST_CASE("The shaft of a stylus that has an orientation lies along z of the tool, its tip at the tool point", "[view]") {
  const Eigen::Matrix3f axes = turned(1.1F, Vec3f(0.6F, 0, 0.8F));
  float along_max = 0, beside_max = 0;
  for (const SolidVertex& v : stylus(axes, false)) {
    const Vec3f in_tool = axes.transpose() * (v.position - Vec3f(1, 2, 3));
    CHECK(in_tool.z() >= -1.001F * kTipM);
    along_max = std::max(along_max, in_tool.z());
    beside_max = std::max(beside_max, in_tool.head<2>().norm());
  }
  CHECK(along_max == Approx(23.4F * kTipM).epsilon(1e-3));
  CHECK(beside_max < 1.5F * kTipM);
}

TEST_CASE("The button of a stylus is on the side of x, and takes the station's colour while it is pressed", "[view]") {
  const Eigen::Matrix3f axes = turned(0.7F, Vec3f::UnitX());
  const SolidMesh free = stylus(axes, false), pressed = stylus(axes, true);
  const auto reach = [&](const SolidMesh& mesh, const Vec3f& side) {
    float most = 0;
    for (const SolidVertex& v : mesh) most = std::max(most, side.dot(axes.transpose() * (v.position - Vec3f(1, 2, 3))));
    return most;
  };
  CHECK(reach(free, Vec3f::UnitX()) > reach(free, -Vec3f::UnitX()) + 0.1F * kTipM);
  CHECK(reach(pressed, Vec3f::UnitX()) < reach(free, Vec3f::UnitX()));
  const auto red = [](const SolidMesh& mesh) {
    return std::count_if(mesh.begin(), mesh.end(), [](const SolidVertex& v) { return v.color == Vec3f(1, 0, 0); });
  };
  CHECK(red(pressed) > red(free));
  CHECK(stylus({}, true) == stylus({}, false));
  CHECK(stylus({}, false).size() < free.size());
}

TEST_CASE("An instrument's jaws are drawn where they are, apart from each other", "[view]") {
  const std::vector<ToolSphere> body{{Vec3(0.003, 0, 0.003), 0.003, 0.04, 0.5}, {Vec3(-0.003, 0, 0.003), 0.003, 0.04, -0.5}};
  for (const double opening : {0.0, 0.8}) {
    SolidMesh mesh;
    const ToolPose pose(Vec3::Zero(), Rotation::Identity(), opening);
    append_instrument(mesh, {pose, body});
    const auto left = static_cast<float>(pose.centre_of(body[1]).x()), right = static_cast<float>(pose.centre_of(body[0]).x());
    float least = 1, most = -1, between = 0;
    for (const SolidVertex& v : mesh) {
      if (v.position.z() > 0.02F || v.position.head<2>().norm() < 0.0017F) continue;  // the handle
      least = std::min(least, v.position.x());
      most = std::max(most, v.position.x());
      if (v.position.x() > left + 0.0031F && v.position.x() < right - 0.0031F) ++between;
    }
    CHECK(least == Approx(left - 0.003F).margin(1e-4));
    CHECK(most == Approx(right + 0.003F).margin(1e-4));
    CHECK(between == 0);
  }
}
