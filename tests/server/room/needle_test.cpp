// A needle in a room: what the player makes of patches before, while and after it enters the body.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/player/player.hpp"
#include "server/room/room.hpp"

using namespace palpate;

namespace {

constexpr Micros kNeedleFrame{50'000};
constexpr double kTopM = 0.06;

Scene tissue_block() {
  return read_scene(R"({"body": {"lattice": {"nodes": [7, 7, 7], "size_m": [0.06, 0.06, 0.06], "fixed_faces": ["z-"],
      "solid": {"element": "hexahedron", "young_pa": 8000, "poisson": 0.45, "law": "neo-hookean", "damping_s": 0.01}},
      "tissue": [{"thickness_m": 0.012, "toughness_j_m2": 164, "puncture_n": 0.5, "friction_n_m": 6}, {"toughness_j_m2": 300, "puncture_n": 0.8}]},
      "tool": {"contact": "touch", "radius_m": 0.02, "needle": {"length_m": 0.04, "diameter_m": 0.00127}}})",
                    "block");
}

struct NeedledRoom {
  Room room{tissue_block()};
  Micros now{7'000'000}, begin = now;
  NeedledRoom() { room.start(now); }
  /// In at 20 mm/s from 2 mm above, out again after 1.3 s, a little inclined and aside; after 3 s again, 12 mm aside.
  ToolPose pose(Micros t) const {
    const double s = seconds(t - begin), u = std::fmod(s, 3), in = u < 1.3 ? u : std::max(2.6 - u, 0.0);
    const double aside_m = 0.012 * (std::floor(s / 3) + std::clamp((u - 2.7) / 0.2, 0.0, 1.0));
    return {Vec3(0.031 + aside_m + 0.001 * std::sin(4 * s), 0.029, kTopM + 0.002 - 0.02 * in),
            Rotation(Eigen::AngleAxisd(0.05 * std::sin(3 * s), Vec3::UnitY()))};
  }
  StationFrame frame(Scheme scheme) {
    FrameJob job;
    job.target = now + kNeedleFrame;
    StationJob hand;
    hand.id = 3;
    hand.scheme = scheme;
    hand.horizon = Micros{100'000};
    for (Micros t = now + kTick; t <= job.target + kTick; t += kTick) hand.samples.push_back({t, pose(t).position, pose(t).turn});
    job.stations.push_back(hand);
    now = job.target;
    return room.run(job).stations.front();
  }
};

}  // namespace

TEST_CASE("The patches of a needle have its path, and a player with them enters the body and feels what it does") {
  const Scheme scheme = GENERATE(Scheme::port, Scheme::hyper);
  CAPTURE(scheme);
  NeedledRoom needled;
  std::optional<PatchPlayer> player;
  double error_n = 0, peak_n = 0, fronts_m = 0, deepest_m = 0;
  int inside = 0, layers_most = 0;
  for (int k = 0; k < 50; ++k) {
    const StationFrame frame = needled.frame(scheme);
    if (player) {
      for (Micros t = player->time() + kTick; t <= needled.now; t += kTick)
        player->advance({t, needled.pose(t).position, needled.pose(t).turn});
      error_n = std::max(error_n, (player->output().force - frame.force).norm());
      peak_n = std::max(peak_n, frame.force.norm());
      if (frame.patch && frame.patch->needle.tip.inside && player->needle_tip().inside)
        fronts_m = std::max(fronts_m, std::abs(frame.patch->needle.tip.front_m - player->needle_tip().front_m));
    }
    player.reset();
    if (!frame.patch) continue;
    REQUIRE(check(*frame.patch) == PatchFault::none);
    REQUIRE_FALSE(frame.patch->needle.empty());
    inside += frame.patch->needle.tip.inside;
    deepest_m = std::max(deepest_m, frame.patch->needle.tip.front_m);
    layers_most = std::max(layers_most, frame.patch->needle.tip.layer);
    player.emplace(*frame.patch, frame.terms);
  }
  CHECK(inside > 30);
  CHECK(layers_most == 1);
  CHECK(deepest_m > 0.02);
  REQUIRE(peak_n > 0.4);
  CHECK(error_n < 0.1 * peak_n);
  CHECK(fronts_m < 2.5e-4);
}

TEST_CASE("A needle that came out may enter elsewhere: clients take every patch, and feel its press before it enters") {
  NeedledRoom needled;
  int after = 0, again = 0;
  bool was_inside = false, came_out = false;
  double pressed_n = 0;
  for (int k = 0; k < 90; ++k) {
    const StationFrame frame = needled.frame(Scheme::port);
    if (!frame.patch) continue;
    CHECK(check(*frame.patch) == PatchFault::none);
    const bool inside = frame.patch->needle.tip.inside;
    came_out |= was_inside && !inside;
    was_inside = inside;
    if (!came_out) continue;
    ++after;
    again += inside;
    if (!inside && again == 0) pressed_n = std::max(pressed_n, PatchPlayer(*frame.patch, frame.terms).output().force.norm());
  }
  CHECK(after > 15);
  CHECK(again > 10);
  CHECK(pressed_n > 0.1);
}

TEST_CASE("A room that is reset takes a needle out of the body, which may enter again from outside alone") {
  NeedledRoom needled;
  StationFrame frame;
  for (int k = 0; k < 16; ++k) frame = needled.frame(Scheme::port);
  REQUIRE(frame.patch);
  REQUIRE(frame.patch->needle.tip.inside);
  FrameJob job;
  job.target = needled.now + kNeedleFrame;
  job.reset = true;
  StationJob hand;
  hand.id = 3;
  hand.horizon = Micros{100'000};
  for (Micros t = needled.now + kTick; t <= job.target; t += kTick)
    hand.samples.push_back({t, needled.pose(needled.now).position, needled.pose(needled.now).turn});
  job.stations.push_back(hand);
  const FrameResult result = needled.room.run(job);
  REQUIRE(result.stations.front().patch);
  CHECK(result.stations.front().patch->constant);
  for (int k = 0; k < 20; ++k) {
    job.reset = false;
    job.begin = job.target;
    job.target += kNeedleFrame;
    for (ToolSample& sample : job.stations.front().samples) sample.t += kNeedleFrame;
    CHECK(needled.room.run(job).stations.front().contact == false);
  }
}
