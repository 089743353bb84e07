// A tool with a body on a patch: its spheres' contacts against closed forms and against its own energy.
#include <catch2/catch.hpp>
#include <cmath>

#include "common/patch/surface.hpp"
#include "common/player/player.hpp"
#include "tests/support/floor_patch.hpp"

using namespace palpate;
using test::floor_patch, test::kStamp;

namespace {

constexpr double kRadiusM = 0.004, kHalfM = 0.02, kContact = 1000;

/// A bar of two spheres over a frictionless floor at z = 0, `height_m` the lowest points' at the stamp. Its tool point is between
/// the lowest points.
Patch bar(int modes, double height_m) {
  Patch p = floor_patch(modes);
  const double floor_m = p.surface.vertices[0].position.z();
  p.c_static.setZero();
  p.contact_stiffness_n_m = kContact;
  p.trust_radius_m = 1;
  p.tool = Vec3(0, 0, floor_m + height_m);
  p.turn = Rotation(Rotation::Identity());
  p.sphere = {Vec3(-kHalfM, 0, kRadiusM), kRadiusM};
  p.others.count = p.others.own = 1;
  OtherContact& other = p.others.of[0];
  other.sphere = {Vec3(kHalfM, 0, kRadiusM), kRadiusM};
  other.gap = Vec3(0, 0, height_m);
  other.normal = Vec3::UnitZ();
  other.rows = p.surface.vertices[0].rows;
  p.touching = false;
  return p;
}

Rotation tilted(double rad) { return Rotation(Eigen::AngleAxisd(rad, Vec3::UnitY())); }

}  // namespace

TEST_CASE("A bar that is pressed and tilted on a floor that does not yield has the force and torque of two springs") {
  const Patch p = bar(0, 0.001);
  REQUIRE(check(p) == PatchFault::none);
  PatchPlayer player(p);
  const double floor_m = p.tool.z() - 0.001;
  PlayerOutput out;
  for (int ms = 1; ms <= 200; ++ms) {
    const double tilt = 0.08 * std::sin(0.03 * ms), height_m = 0.001 - 0.003 * ms / 200.0;
    out = player.advance({kStamp + Micros{1000 * ms}, Vec3(0, 0, floor_m + height_m), tilted(tilt)});
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    for (const double side : {-1.0, 1.0}) {
      const Vec3 centre = tilted(tilt) * Vec3(side * kHalfM, 0, kRadiusM);
      const double gap_m = height_m + centre.z() - kRadiusM;
      const Vec3 push(0, 0, kContact * std::max(0.0, -gap_m));
      force += push;
      torque += (centre - kRadiusM * Vec3::UnitZ()).cross(push);
    }
    CAPTURE(ms, tilt);
    CHECK((out.force - force).norm() < 1e-9);
    CHECK((out.torque - torque).norm() < 1e-11);
    CHECK(out.contact == (force.norm() > 0));
  }
  CHECK(out.force.z() > 1);
}

TEST_CASE("The torque of a bar at rest is the slope of its energy over the angle, on a floor that yields") {
  Patch p = bar(6, 0.0);
  // The floor moves differently under the two spheres.
  p.others.of[0].rows.col(0) *= -0.4;
  p.others.of[0].rows.col(2) *= 1.7;
  for (int i = 0; i < 6; ++i) p.damping(i, i) = 2 * std::sqrt(p.stiffness[i]);
  REQUIRE(check(p) == PatchFault::none);
  const double depth_m = 0.004;
  const auto at_rest = [&](double tilt) {
    PatchPlayer player(p);
    for (int ms = 1; ms <= 1500; ++ms) {
      const double share = std::min(1.0, ms / 300.0);
      player.advance({kStamp + Micros{1000 * ms}, p.tool - Vec3(0, 0, share * depth_m), tilted(share * tilt)});
    }
    return player;
  };
  // Energy of modes and contact springs: with a floor at rest each spring carries its push.
  const auto energy_j = [&](double tilt) {
    const PatchPlayer player = at_rest(tilt);
    const PlayerOutput& out = player.output();
    // Two unknown pushes along z from force and torque: x_a F_a + x_b F_b = -torque.y.
    const double xa = (tilted(tilt) * p.sphere.centre).x(), xb = (tilted(tilt) * p.others.of[0].sphere.centre).x();
    const double fb = (-out.torque.y() - xa * out.force.z()) / (xb - xa), fa = out.force.z() - fb;
    return player.energy() + (fa * fa + fb * fb) / (2 * kContact);
  };
  constexpr double kTilt = 0.05, kStep = 1e-3;
  const double torque = at_rest(kTilt).output().torque.y();
  const double slope = (energy_j(kTilt + kStep) - energy_j(kTilt - kStep)) / (2 * kStep);
  CHECK(torque == Approx(-slope).epsilon(1e-3));
  CHECK(std::abs(torque) > 1e-3);
}

TEST_CASE("A tool with a body whose device has no orientation is held upright, and one sphere without radius is the point") {
  const Patch p = bar(4, 0.0005);
  PatchPlayer upright(p), unsaid(p);
  Patch one = p;
  one.others = {};
  one.sphere = {};
  one.tool = p.tool;
  Patch point = one;
  point.turn.reset();
  PatchPlayer sphere(one), bare(point);
  for (int ms = 1; ms <= 100; ++ms) {
    const Micros t = kStamp + Micros{1000 * ms};
    const Vec3 tool = p.tool - Vec3(0, 0, 2e-5 * ms);
    CHECK(upright.advance({t, tool, Rotation(Rotation::Identity())}).torque == unsaid.advance({t, tool}).torque);
    CHECK(upright.output().force == unsaid.output().force);
    CHECK(sphere.advance({t, tool, tilted(0.01 * ms)}).force == bare.advance({t, tool, tilted(0.01 * ms)}).force);
    CHECK(sphere.output().torque.norm() == 0);
  }
  CHECK(bare.output().contact);
}

TEST_CASE("Which of a tool's spheres is the patch's own contact makes no difference, wherever they slide") {
  // On a floor of which every place moves otherwise, so that a contact that did not slide with its rows would push wrongly.
  Patch left = bar(6, 0.0);
  for (int i = 0; i < left.surface.vertex_count; ++i) left.surface.vertices[static_cast<std::size_t>(i)].rows *= 0.6 + 0.15 * i;
  for (int i = 0; i < 6; ++i) left.damping(i, i) = 2 * std::sqrt(left.stiffness[i]);
  constexpr double kShortM = 0.011;
  std::vector<double> x;
  for (int i = 0; i < left.surface.vertex_count; ++i)
    x.insert(x.end(), left.surface.vertices[static_cast<std::size_t>(i)].position.data(),
             left.surface.vertices[static_cast<std::size_t>(i)].position.data() + 3);
  const Surface surface({left.surface.triangles.begin(), left.surface.triangles.begin() + left.surface.triangle_count},
                        static_cast<std::size_t>(left.surface.vertex_count));
  const auto begin_at = [&](Patch& p, double own_x) {
    p.sphere.centre.x() = own_x;
    p.others.of[0].sphere.centre.x() = -own_x;
    p.point = nearest_point(surface.view(), x, p.tool + own_x * Vec3::UnitX()).point;
    PortRows& rows = p.others.of[0].rows;
    const SurfacePoint other = nearest_point(surface.view(), x, p.tool - own_x * Vec3::UnitX()).point;
    rows.setZero();
    for (std::size_t k = 0; k < 3; ++k)
      rows += other.weight[static_cast<int>(k)] * p.surface.vertices[p.surface.triangles[other.triangle][k]].rows;
    REQUIRE(check(p) == PatchFault::none);
  };
  Patch right = left;
  begin_at(left, -kShortM);
  begin_at(right, kShortM);
  PatchPlayer of_left(left), of_right(right);
  for (int ms = 1; ms <= 2000; ++ms) {
    const double share = std::min(1.0, ms / 400.0);
    const Vec3 tool = left.tool + share * Vec3(0.003, -0.004, -0.002);
    const Rotation turn(Eigen::AngleAxisd(0.7 * share, Vec3::UnitZ()));
    of_left.advance({kStamp + Micros{1000 * ms}, tool, turn});
    of_right.advance({kStamp + Micros{1000 * ms}, tool, turn});
  }
  CHECK(of_left.output().force.z() > 0.5);
  CHECK((of_left.output().force - of_right.output().force).norm() < 1e-6 * of_left.output().force.norm());
  CHECK((of_left.output().torque - of_right.output().torque).norm() < 1e-6 * of_left.output().torque.norm());
}

TEST_CASE("The grip of jaws that are pressed on a floor is the moment of its springs by the opening") {
  Patch p = bar(0, 0.001);
  p.sphere.hinge_m = p.others.of[0].sphere.hinge_m = 0.05;
  p.sphere.centre.x() = -0.5 * kHalfM;
  p.others.of[0].sphere.centre.x() = 0.5 * kHalfM;
  p.sphere.swing_rad = -0.1;
  p.others.of[0].sphere.swing_rad = 0.1;
  REQUIRE(check(p) == PatchFault::none);
  PatchPlayer player(p);
  const double step = 1e-5;
  for (int ms = 1; ms <= 100; ++ms) {
    const double opening = 0.5 * ms / 100.0, height_m = 0.001 - 0.007 * ms / 100.0;
    const PlayerOutput out = player.advance(
        {kStamp + Micros{1000 * ms}, p.tool + Vec3(0, 0, height_m - 0.001), Rotation(Rotation::Identity()), opening});
    // -dE / d opening of E = sum k_c / 2 depth^2.
    const auto energy = [&](double o) {
      double sum = 0;
      for (const ToolSphere& sphere : {p.sphere, p.others.of[0].sphere}) {
        const double depth = std::max(0.0, -(height_m + sphere.centre_at(o).z() - sphere.radius_m));
        sum += 0.5 * kContact * depth * depth;
      }
      return sum;
    };
    CAPTURE(ms);
    CHECK(out.grip == Approx(-(energy(opening + step) - energy(opening - step)) / (2 * step)).margin(1e-7));
  }
  CHECK(std::abs(player.output().grip) > 1e-3);
}
