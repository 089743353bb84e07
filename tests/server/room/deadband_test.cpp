// Patches whose changes cannot be felt: when a patch must be sent, and when the station's own is renewed.
#include "server/room/deadband.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "server/room/room.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kStart{7'000'000}, kDeadbandFrame{50'000};
constexpr double kFraction = 0.1;

/// A spring at the origin with its tool 10 mm inside: 1 N at 100 N/m.
Patch spring(Micros stamp, double stiffness_n_m, double force_n) {
  Patch p;
  p.stamp = stamp;
  p.scheme = Scheme::tangent;
  p.touching = true;
  p.force = Vec3(0, 0, force_n);
  p.tool = Vec3(0, 0, -0.01);
  p.k_port = stiffness_n_m * Mat3::Identity();
  p.trust_radius_m = 0.05;
  p.valid_for = Micros{500'000};
  return p;
}

/// A resting tool.
ToolTrack resting(Micros until) {
  ToolTrack track;
  std::vector<ToolSample> samples;
  for (Micros t = kStart - kTick; t <= until; t += kTick) samples.push_back({t, Vec3(0, 0, -0.01)});
  track.add(samples);
  return track;
}

/// Returns true if a second patch, a frame after one of 1 N at 100 N/m, need not be sent to a station that plays the first.
bool needless(const Patch& second, Micros horizon = Micros{100'000}) {
  Deadband deadband;
  const ToolTrack track = resting(second.stamp);
  CHECK_FALSE(deadband.pass(spring(kStart, 100, 1), {}, {kFraction, horizon, std::nullopt, &track}));
  const auto renewed_from = deadband.pass(second, {}, {kFraction, horizon, kStart, &track});
  if (renewed_from) CHECK(*renewed_from == kStart);
  return renewed_from.has_value();
}

/// A room whose single station reports at once that it plays its newest patch.
struct DeadbandStage {
  Room room;
  Micros now = kStart, stamp{};
  std::optional<Micros> playing;
  double deadband = kFraction;
  int sent = 0, renewed = 0;

  explicit DeadbandStage(const Scene& scene) : room(scene) { room.start(now); }

  StationFrame frame(const std::function<Vec3(double)>& tool) {
    FrameJob job;
    job.target = now + kDeadbandFrame;
    StationJob station;
    station.id = 3;
    station.horizon = kDeadbandFrame;
    station.deadband = deadband;
    station.playing = playing;
    for (Micros t = now + kTick; t <= job.target + kTick; t += kTick) station.samples.push_back({t, tool(seconds(t - kStart))});
    job.stations.push_back(station);
    now = job.target;
    StationFrame frame = room.run(job).stations.front();
    if (!frame.patch) return frame;
    (frame.renewed_from ? renewed : sent) += 1;
    if (!frame.renewed_from) playing = stamp = frame.patch->stamp;
    return frame;
  }
};

}  // namespace

TEST_CASE("A change of the force by less than half the fraction need not be sent, one by more is") {
  const Micros next = kStart + kDeadbandFrame;
  CHECK(needless(spring(next, 100, 1)));
  CHECK(needless(spring(next, 100, 1.04)));
  CHECK(needless(spring(next, 100, 0.96)));
  CHECK_FALSE(needless(spring(next, 100, 1.06)));
  CHECK_FALSE(needless(spring(next, 100, 0.94)));
}

TEST_CASE("A change of the stiffness that a hand could feel by moving on is sent although the force is the same") {
  const Micros next = kStart + kDeadbandFrame;
  CHECK(needless(spring(next, 110, 1)));  // 3 mm further inside: 1.3 and 1.33 N
  CHECK_FALSE(needless(spring(next, 130, 1)));
  CHECK_FALSE(needless(spring(next, 70, 1)));
}

TEST_CASE("A force that is nearly nothing may be wrong by no more than a twentieth of 0.1 N") {
  Deadband deadband;
  const Micros next = kStart + kDeadbandFrame;
  const ToolTrack track = resting(next);
  const auto soft = [](Micros stamp, double force_n) { return spring(stamp, 1e-6, force_n); };
  deadband.pass(soft(kStart, 0.01), {}, {kFraction, kDeadbandFrame, std::nullopt, &track});
  CHECK(deadband.pass(soft(next, 0.0149), {}, {kFraction, kDeadbandFrame, kStart, &track}));
  CHECK_FALSE(deadband.pass(soft(next, 0.0151), {}, {kFraction, kDeadbandFrame, kStart, &track}));
}

TEST_CASE("A patch that begins in contact is sent to a station whose own does not, at the very onset") {
  Patch free = spring(kStart, 1e-9, 0);
  free.touching = false;
  Deadband deadband;
  const Micros next = kStart + kDeadbandFrame;
  const ToolTrack track = resting(next);
  deadband.pass(free, {}, {kFraction, kDeadbandFrame, std::nullopt, &track});
  CHECK_FALSE(deadband.pass(spring(next, 1e-9, 0), {}, {kFraction, kDeadbandFrame, kStart, &track}));
}

TEST_CASE("Nothing is renewed that the station has not said it plays, and every patch on its way counts") {
  Deadband deadband;
  const ToolTrack track = resting(kStart + 3 * kDeadbandFrame);
  const auto pass = [&](int frame, double force_n, std::optional<Micros> playing) {
    return deadband.pass(spring(kStart + frame * kDeadbandFrame, 100, force_n), {}, {kFraction, kDeadbandFrame, playing, &track});
  };
  CHECK_FALSE(pass(0, 1, std::nullopt));
  CHECK_FALSE(pass(1, 1, std::nullopt));  // not reported
  CHECK_FALSE(pass(2, 1.2, kStart));      // too different
  CHECK_FALSE(pass(3, 1.2, kStart));      // the one in flight would be good enough, the one that is played is not
  CHECK(pass(3, 1.2, kStart + 2 * kDeadbandFrame) == kStart + 2 * kDeadbandFrame);
  CHECK_FALSE(pass(3, 1.2, kStart + kDeadbandFrame / 2));  // no such patch
}

TEST_CASE("No patch is renewed for longer than a second") {
  const Micros horizon{100'000}, last = kStart + Deadband::kPatchAgeMost - horizon;
  CHECK(needless(spring(last, 100, 1), horizon));
  CHECK_FALSE(needless(spring(last + Micros{1}, 100, 1), horizon));
}

TEST_CASE("A link that became longer gets a patch that lasts for it") {
  Patch longer = spring(kStart + kDeadbandFrame, 100, 1);
  longer.valid_for = Micros{550'000};
  CHECK(needless(longer));
  longer.valid_for = Micros{560'000};
  CHECK_FALSE(needless(longer));
}

TEST_CASE("A hand that holds a body still is sent two patches a second, one that begins to move gets the next at once") {
  const Scene scene = box_scene(ContactKind::attach);
  const Vec3 home = scene.body.nodes[scene.tool.node];
  DeadbandStage stage(scene);
  const auto hand = [&](double t_s) { return Vec3(home - Vec3(0, 0, t_s < 4 ? 0.0 : 0.1 * (t_s - 4))); };
  for (int k = 0; k < 79; ++k) stage.frame(hand);
  CHECK(stage.sent <= 6);
  CHECK(stage.renewed >= 73);
  const int before = stage.sent;
  stage.frame(hand);
  stage.frame(hand);
  CHECK(stage.sent > before);
}

TEST_CASE("Without a deadband every frame has its patch, and with one the patches are the same") {
  const Scene scene = box_scene(ContactKind::attach);
  const Vec3 home = scene.body.nodes[scene.tool.node];
  DeadbandStage all(scene), some(scene);
  all.deadband = 0;
  const auto hand = [&](double t_s) { return Vec3(home - Vec3(0, 0, 0.004 * std::sin(6 * t_s))); };
  for (int k = 0; k < 20; ++k) {
    const StationFrame a = all.frame(hand), b = some.frame(hand);
    REQUIRE(a.patch);
    REQUIRE(b.patch);
    CHECK_FALSE(a.renewed_from);
    CHECK(a.patch->force == b.patch->force);
    CHECK(a.patch->stiffness == b.patch->stiffness);
  }
  CHECK(all.sent == 20);
  CHECK(some.renewed > 0);
  CHECK(some.sent > 2);
}

TEST_CASE("A tool that comes down on a body is sent a patch in the frame in which it touches it") {
  Scene scene = box_scene(ContactKind::touch);
  const Vec3 top = scene.body.nodes[scene.tool.node];
  DeadbandStage stage(scene);
  const auto hand = [&](double t_s) { return Vec3(top + Vec3(0.001, 0.002, 0.003 - (t_s < 1 ? 0.0 : 0.02 * (t_s - 1)))); };
  bool touched = false;
  for (int k = 0; k < 30; ++k) {
    const StationFrame frame = stage.frame(hand);
    REQUIRE(frame.patch);
    if (frame.contact && !touched) CHECK_FALSE(frame.renewed_from);
    if (frame.renewed_from) CHECK(frame.patch->touching == touched);
    touched = frame.contact;
  }
  CHECK(touched);
  CHECK(stage.renewed > 10);
}
