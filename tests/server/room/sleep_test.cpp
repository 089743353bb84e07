// A body at rest sleeps; it wakes for a tool, and the sleep is not felt.
#include <catch2/catch.hpp>
#include <chrono>

#include "server/body/stillness.hpp"
#include "server/room/room.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;
using namespace std::chrono_literals;

namespace {

constexpr Micros kSleepFrame{50'000};
constexpr StationId kSleepHand = 3;
constexpr double kTop = 3 * kSpacingM;

using Path = std::function<Vec3(Micros)>;

struct SleepBed {
  bool sleep;
  Room room;
  Micros now{7'000'000};

  explicit SleepBed(bool may_sleep = true, ContactKind contact = ContactKind::touch)
      : sleep(may_sleep), room(box_scene(contact)) {
    room.start(now);
  }

  /// Runs a frame with a hand on `path`, or without a hand.
  FrameResult frame(const Path& path = {}) {
    FrameJob job;
    job.begin = now;
    job.target = now + kSleepFrame;
    job.frame = kSleepFrame;
    job.shapes = true;
    job.may_sleep = sleep;
    if (path) {
      StationJob station;
      station.id = kSleepHand;
      station.horizon = 100ms;
      for (Micros t = now + 1ms; t <= job.target + 1ms; t += 1ms) station.samples.push_back({t, path(t)});
      job.stations.push_back(station);
    }
    now = job.target;
    return room.run(job);
  }
};

/// Above the middle of a triangle of the top.
Path at_height(double height_m) {
  return [height_m](Micros) { return Vec3(0.031, 0.028, kTop + height_m); };
}

/// Down at `speed_m_s` from `height_m`, from 7 s on.
Path falling(double height_m, double speed_m_s) {
  return [=](Micros t) { return at_height(height_m - speed_m_s * seconds(t - 7s))(t); };
}

double farthest(const FrameResult& a, const FrameResult& b) {
  double far = 0;
  for (std::size_t i = 0; i < a.positions.size(); ++i) far = std::max(far, (a.positions[i] - b.positions[i]).norm());
  return far;
}

}  // namespace

TEST_CASE("A body that nobody touches sleeps: time passes, no step is made, and it stays where it is to the bit") {
  SleepBed bed;
  const FrameResult first = bed.frame();
  for (int k = 0; k < 10; ++k) {
    const FrameResult result = bed.frame();
    CHECK(result.asleep);
    CHECK(result.steps == 0);
    CHECK(result.stamp == bed.now);
    CHECK(result.positions == first.positions);
  }
}

TEST_CASE(
    "A body that swings after a touch falls asleep when it is still, never further than the bound from one that never sleeps") {
  SleepBed bed, awake(false);
  for (int k = 0; k < 10; ++k) bed.frame(at_height(-0.006)), awake.frame(at_height(-0.006));
  int stepped = 0;
  for (int k = 0; k < 100; ++k) {
    const FrameResult a = bed.frame(), b = awake.frame();
    CHECK_FALSE(b.asleep);
    CHECK(b.steps > 0);
    CHECK(farthest(a, b) < Stillness::kMovesM);
    stepped += a.steps > 0;
    CHECK(a.asleep == (stepped <= k || a.asleep));
  }
  CHECK(stepped > 3);
  CHECK(stepped < 100);
  CHECK(bed.frame().asleep);
}

TEST_CASE("A tool that comes meets a sleeping body in the same frame, with the same force, as one that never sleeps") {
  for (const double speed_m_s : {0.02, 0.11, 0.9}) {
    INFO(speed_m_s << " m/s");
    SleepBed bed, awake(false);
    int asleep = 0, touched = 0;
    for (int k = 0; k < 40 && touched < 5; ++k) {
      const Path path = falling(0.03, speed_m_s);
      const FrameResult a = bed.frame(path), b = awake.frame(path);
      const StationFrame &x = a.stations.at(0), &y = b.stations.at(0);
      CHECK(x.contact == y.contact);
      CHECK((x.force - y.force).norm() < 1e-3);
      CHECK(x.patch.has_value() == y.patch.has_value());
      if (x.contact) CHECK(a.steps > 0);
      asleep += a.steps == 0;
      touched += x.contact;
    }
    CHECK(touched > 0);
    if (speed_m_s < 0.5) CHECK(asleep > 0);
  }
}

TEST_CASE("A tool that hovers leaves the body asleep and gets its anticipating patch, one that holds or touches keeps it awake") {
  SleepBed bed;
  bed.frame(at_height(0.008));
  const FrameResult hover = bed.frame(at_height(0.008));
  CHECK(hover.asleep);
  CHECK(hover.steps == 0);
  REQUIRE(hover.stations[0].patch);
  CHECK(hover.stations[0].patch->stamp == bed.now);
  FrameResult pressed;
  for (int k = 0; k < 100; ++k) pressed = bed.frame(at_height(-0.003));
  CHECK_FALSE(pressed.asleep);
  SleepBed held(true, ContactKind::attach);
  const Vec3 home = box_scene(ContactKind::attach).body.nodes[54];
  for (int k = 0; k < 20; ++k) CHECK_FALSE(held.frame([&](Micros) { return home; }).asleep);
  for (int k = 0; k < 100; ++k) held.frame();
  CHECK(held.frame().asleep);
}

TEST_CASE("A body that slept for a day is stepped from the beginning of the frame in which it wakes") {
  SleepBed bed;
  CHECK(bed.frame().asleep);
  bed.now += 24h;
  const FrameResult woken = bed.frame(at_height(-0.002));
  CHECK(woken.stamp == bed.now);
  CHECK_FALSE(woken.asleep);
  CHECK(woken.steps > 0);
  CHECK(woken.steps < 100);
  CHECK(woken.stations.at(0).contact);
}

TEST_CASE("A hand that lingers over a sleeping body gets the same patch again, newly stamped, one that moves on gets a new one") {
  SleepBed bed;
  const auto trembling = [](Micros t) { return Vec3(at_height(0.008)(t) + Vec3(3e-4 * std::sin(25 * seconds(t)), 0, 0)); };
  bed.frame(trembling);
  const Patch first = *bed.frame(trembling).stations.at(0).patch;
  for (int k = 0; k < 10; ++k) {
    const FrameResult result = bed.frame(trembling);
    const Patch& again = *result.stations.at(0).patch;
    CHECK(result.asleep);
    CHECK(again.stiffness == first.stiffness);
    CHECK(again.surface.vertices[0].rows == first.surface.vertices[0].rows);
    CHECK(again.seq == first.seq + 1 + static_cast<std::uint32_t>(k));
    CHECK(again.stamp == bed.now);
    CHECK((again.tool - trembling(bed.now)).norm() < 1e-12);
    CHECK(check(again) == PatchFault::none);
  }
  const Patch moved = *bed.frame([&](Micros t) { return Vec3(trembling(t) + Vec3(0, 0.004, 0)); }).stations.at(0).patch;
  CHECK_FALSE(moved.surface.vertices[0].rows == first.surface.vertices[0].rows);
}
