// A needle on a patch: its contacts against closed forms, and against its own energy.
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/random.hpp"
#include "common/player/player.hpp"
#include "tests/support/floor_patch.hpp"

using namespace palpate;
using test::floor_patch, test::kStamp;

namespace {

constexpr double kContactNM = 1000, kNeedlePunctureN = 0.6, kNeedleCutN = 0.2, kNeedleFrictionNM = 5, kNeedleLengthM = 0.04;

/// A needle 1 mm above the floor, upright, with `modes` modes that move the points of its path as they move the floor, less and
/// less downwards.
Patch needle_over_floor(int modes) {
  Patch p = floor_patch(modes);
  const Vec3 floor = p.surface.vertices[0].position;
  p.c_static.setZero();
  p.contact_stiffness_n_m = kContactNM;
  p.trust_radius_m = 1;
  p.valid_for = Micros{60'000'000};
  p.tool = Vec3(0, 0, floor.z() + 0.001);
  p.turn = Rotation(Rotation::Identity());
  p.touching = false;
  p.needle.layers.count = 1;
  p.needle.layers.length_m = kNeedleLengthM;
  p.needle.layers.of[0] = {0, kNeedlePunctureN, kNeedleCutN, kNeedleFrictionNM};
  for (int j = 0; j < kNeedlePoints; ++j) {
    PatchNeedle::Point& point = p.needle.points[static_cast<std::size_t>(j)];
    point.position = Vec3(0, 0, floor.z() - j * p.needle.layers.spacing_m());
    point.rows = (1 - 0.15 * j) * p.surface.vertices[0].rows;
  }
  return p;
}

ToolSample at(int ms, const Vec3& position) { return {kStamp + Micros{1000 * ms}, position, Rotation(Rotation::Identity())}; }

}  // namespace

TEST_CASE("A needle that is pushed into a floor that does not yield has the forces of the law, in and out") {
  const Patch p = needle_over_floor(0);
  REQUIRE(check(p) == PatchFault::none);
  PatchPlayer player(p);
  double most_n = 0;
  int ms = 0;
  for (; ms <= 320; ++ms) {
    const PlayerOutput out = player.advance(at(ms, p.tool - Vec3(0, 0, 1e-4 * ms)));
    if (!player.needle_tip().inside) most_n = std::max(most_n, out.force.z());
  }
  CHECK(most_n == Approx(kNeedlePunctureN).epsilon(0.15));  // steps of 0.1 N a tick
  const double depth_m = player.needle_tip().depth_m;
  CHECK(depth_m == Approx(0.031 - kNeedleCutN / kContactNM));
  CHECK(player.output().force.z() == Approx(kNeedleCutN + kNeedleFrictionNM * depth_m).epsilon(0.01));
  CHECK(player.output().contact);
  for (int back = 0; back < 200; ++back) player.advance(at(ms++, p.tool - Vec3(0, 0, 0.032 - 1e-4 * back)));
  CHECK(player.output().force.z() == Approx(-kNeedleFrictionNM * player.needle_tip().depth_m).epsilon(0.01));
  CHECK(player.needle_tip().front_m == depth_m);
  for (int back = 200; back < 330; ++back) player.advance(at(ms++, p.tool - Vec3(0, 0, 0.032 - 1e-4 * back)));
  CHECK_FALSE(player.needle_tip().inside);
  CHECK(player.output().force.norm() == 0);
}

TEST_CASE("A needle that is tilted in a floor that does not yield has the torque of the springs along its shaft") {
  Patch p = needle_over_floor(0);
  p.needle.layers.of[0].friction_n_m = 0;
  PatchPlayer player(p);
  int ms = 0;
  for (; ms <= 250; ++ms) player.advance(at(ms, p.tool - Vec3(0, 0, 1e-4 * ms)));
  const Vec3 tip = p.tool - Vec3(0, 0, 0.025);
  const Rotation tilted(Eigen::AngleAxisd(0.05, Vec3::UnitY()));
  const PlayerOutput out = player.advance({kStamp + Micros{1000 * ms}, tip, tilted});
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  const Vec3 axis = tilted * Vec3::UnitZ();
  for (int j = 0; j < kNeedlePoints; ++j) {
    const double share_m = shaft_share(p.needle.layers, player.needle_tip(), j).length_m;
    if (!(share_m > 0)) continue;
    const Vec3 from_tip = p.needle.points[static_cast<std::size_t>(j)].position - tip;
    const Vec3 across = axis * axis.dot(from_tip) - from_tip;
    const Vec3 push = kContactNM * share_m / p.needle.layers.spacing_m() * across;
    force -= push;
    torque -= (axis * axis.dot(from_tip)).cross(push);
  }
  REQUIRE(torque.norm() > 0.01);
  CHECK((out.torque - torque).norm() < 0.02 * torque.norm());
  CHECK((out.force - force - Vec3(0, 0, out.force.z() - force.z())).norm() < 0.02 * force.norm());
}

TEST_CASE("A hand can take no energy from a needle in a floor that yields, however it moves") {
  Patch p = needle_over_floor(6);
  for (int i = 0; i < 6; ++i) p.damping(i, i) = 0.05 * std::sqrt(p.stiffness[i]);
  REQUIRE(check(p) == PatchFault::none);
  Random random(3);
  for (int trial = 0; trial < 10; ++trial) {
    PatchPlayer player(p);
    Vec3 tool = p.tool, goal = tool, before = Vec3::Zero();
    double spent_j = 0;
    for (int ms = 1; ms <= 3000; ++ms) {
      if (ms % 150 == 1)
        goal = p.tool + Vec3(random.uniform(-0.002, 0.002), random.uniform(-0.002, 0.002), random.uniform(-0.034, 0));
      const Vec3 step = std::min(1.0, 2e-4 / std::max((goal - tool).norm(), 1e-12)) * (goal - tool);
      const PlayerOutput out = player.advance(at(ms, tool += step));
      spent_j -= 0.5 * (before + out.force).dot(step);
      before = out.force;
      CHECK(out.force.allFinite());
      CHECK(spent_j > -1e-5);
    }
    CHECK(spent_j - player.energy() > 0);
  }
}

TEST_CASE("Scissors that close feel what a needle feels that is pushed the way of their crossing, and the grip is its power") {
  constexpr double kSlideM = 0.03, kStepM = 1e-4;
  const Rotation turn(Eigen::AngleAxisd(0.1, Vec3(1, 2, 0).normalized()));
  const Vec3 axis = turn * Vec3::UnitZ();
  Patch pushed = needle_over_floor(6);
  pushed.turn = turn;
  Patch closed = pushed;
  closed.sphere.slide_m = kSlideM;
  closed.opening = 1;
  closed.tool -= kSlideM * axis;
  REQUIRE(check(closed) == PatchFault::none);
  PatchPlayer needle(pushed), scissors(closed);
  double before_n = 0, given_j = 0, spent_j = 0;
  for (int ms = 1; ms <= 400; ++ms) {
    // Half of the way into the body is the hand's, and the blades open again at the end.
    const double way_m = kStepM * (ms <= 250 ? ms : 500 - ms), hand_m = 0.5 * way_m, opening = 1 - (way_m - hand_m) / kSlideM;
    const PlayerOutput a = needle.advance({kStamp + Micros{1000 * ms}, pushed.tool - way_m * axis, turn});
    const PlayerOutput b = scissors.advance({kStamp + Micros{1000 * ms}, closed.tool - hand_m * axis, turn, opening});
    CHECK((a.force - b.force).norm() < 1e-9);
    CHECK(a.contact == b.contact);
    if (!scissors.needle_tip().inside) continue;
    const Vec3 arm = opening * kSlideM * axis;
    CHECK((b.torque - a.torque - arm.cross(a.force)).norm() < 1e-9);
    const double along_n = axis.dot(b.force), step_m = ms <= 250 ? kStepM : -kStepM;
    given_j += 0.5 * (along_n + before_n) * step_m;
    spent_j += 0.5 * (along_n + before_n) * 0.5 * step_m - 0.5 * (b.grip + before_n * kSlideM) * (-0.5 * step_m / kSlideM);
    before_n = along_n;
  }
  CHECK(needle.needle_tip().front_m > 0.02);
  CHECK(scissors.needle_tip().front_m == Approx(needle.needle_tip().front_m).epsilon(1e-9));
  CHECK(spent_j == Approx(given_j).epsilon(1e-9));
}

TEST_CASE("A needle that is in the body at the stamp goes on with the forces that it had") {
  Patch inside = needle_over_floor(0);
  PatchPlayer rigid(inside);
  for (int k = 0; k <= 230; ++k) rigid.advance(at(k, inside.tool - Vec3(0, 0, 1e-4 * k)));
  inside.needle.tip = rigid.needle_tip();
  inside.touching = true;
  inside.tool -= Vec3(0, 0, 1e-4 * 230);
  inside.force = rigid.output().force;
  const double depth_m = rigid.needle_tip().depth_m;
  for (int j = 0; j < kNeedlePoints; ++j) {
    PatchNeedle::Point& point = inside.needle.points[static_cast<std::size_t>(j)];
    const double share_m = shaft_share(inside.needle.layers, inside.needle.tip, j).length_m;
    // A shaft that slides bears its friction: the spring along it is stretched by kNeedleStickM.
    point.bond_m = point.position.z() - inside.tool.z() -
                   (share_m > 0 && j * inside.needle.layers.spacing_m() < depth_m ? kNeedleStickM : 0);
  }
  REQUIRE(check(inside) == PatchFault::none);
  PatchPlayer next(inside);
  const PlayerOutput out = next.advance(at(1, inside.tool - Vec3(0, 0, 1e-4)));
  CHECK(out.force.z() == Approx(rigid.output().force.z()).epsilon(0.1));
  CHECK(next.needle_tip().front_m >= inside.needle.tip.front_m);
}
