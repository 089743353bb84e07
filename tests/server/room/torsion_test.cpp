// The torque on an instrument that twists a bar, against Saint-Venant's torsion.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "common/player/player.hpp"
#include "server/room/room.hpp"

using namespace palpate;

namespace {

constexpr double kSideM = 0.03;

/// A bar of a square section that stands on its end, and an instrument that holds its top between spheres, two on each side.
Scene bar_in_a_socket() {
  Scene scene = read_scene(R"({"body": {"lattice": {
    "nodes": [11, 11, 25], "size_m": [0.03, 0.03, 0.12], "origin_m": [-0.015, -0.015, 0], "fixed_faces": ["z-"],
    "solid": {"young_pa": 30000, "poisson": 0.4, "damping_s": 0.02}}},
    "tool": {"mu": 0, "contact_stiffness_n_m": 5000, "body": {"spheres": [{"center_m": [0, 0, 0], "radius_m": 0.003}]}}})",
                           "bar");
  scene.tool.shape.clear();
  constexpr double kRadiusM = 0.003, kInM = 0.0005;
  const double out = 0.5 * kSideM + kRadiusM - kInM;
  for (int side = 0; side < 4; ++side)
    for (const double along : {-0.009, 0.009}) {
      const Eigen::AngleAxisd turn(side * std::numbers::pi / 2, Vec3::UnitZ());
      scene.tool.shape.push_back({turn * Vec3(out, along, 0), kRadiusM});
    }
  return scene;
}

/// Angle about z of the surface's nodes at a height, by least squares of small displacements [rad].
double twist_at(double height_m, const std::vector<Vec3>& rest, const std::vector<Vec3>& now) {
  double moment = 0, square = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const bool outer = rest[i].head<2>().cwiseAbs().maxCoeff() > 0.49 * kSideM;
    if (!outer || std::abs(rest[i].z() - height_m) > 1e-6) continue;
    const Vec3 r(rest[i].x(), rest[i].y(), 0);
    moment += r.cross(now[i] - rest[i]).z();
    square += r.squaredNorm();
  }
  REQUIRE(square > 0);
  return moment / square;
}

}  // namespace

TEST_CASE("An instrument that twists a bar feels the torque of Saint-Venant's torsion") {
  const Scene scene = bar_in_a_socket();
  Room room(scene);
  FrameJob job;
  job.target = Micros{1'000'000};
  job.frame = Micros{50'000};
  job.shapes = true;
  room.start(job.target);
  constexpr double kTurnRad = 0.08;
  const Micros begin = job.target;
  FrameResult result;
  for (int frame = 0; frame < 24; ++frame) {
    job.begin = std::exchange(job.target, job.target + job.frame);
    StationJob hand;
    hand.id = 1;
    hand.scheme = Scheme::hold;
    hand.horizon = job.frame;
    for (Micros t = job.begin + kTick; t <= job.target; t += kTick) {
      const double share = std::clamp((seconds(t - begin) - 0.2) / 0.5, 0.0, 1.0);
      hand.samples.push_back({t, Vec3(0, 0, 0.11), Rotation(Eigen::AngleAxisd(kTurnRad * share, Vec3::UnitZ()))});
    }
    job.stations = {hand};
    result = room.run(job);
    REQUIRE(result.released.empty());
  }
  const double low = twist_at(0.03, scene.body.nodes, result.positions),
               high = twist_at(0.08, scene.body.nodes, result.positions);
  const double shear_pa = 30000 / (2 * 1.4), constant_m4 = 0.1406 * std::pow(kSideM, 4);
  const double torque_nm = shear_pa * constant_m4 * (high - low) / 0.05;
  CHECK(high > 0.5 * kTurnRad);
  CHECK(-result.stations.front().torque.z() == Approx(torque_nm).epsilon(0.05));
  CHECK(result.stations.front().torque.head<2>().norm() < 0.05 * torque_nm);
}
