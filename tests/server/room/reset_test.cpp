// A body that is reset to rest while a hand is inside.
#include <catch2/catch.hpp>

#include "common/player/player.hpp"
#include "server/room/room.hpp"
#include "server/room/tool_coupling.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kResetFrame{50'000};
constexpr double kResetTop = 3 * kSpacingM;

struct ResetBed {
  Room room;
  Micros now{7'000'000};
  double at_m = 0.01;  // height over the top

  explicit ResetBed(ContactKind contact = ContactKind::touch) : room(box_scene(contact)) { room.start(now); }

  /// Moves the hand to `height_m` over the top.
  FrameResult frame(double height_m, bool reset = false) {
    FrameJob job;
    job.begin = now;
    job.target = now + kResetFrame;
    job.frame = kResetFrame;
    job.reset = reset;
    job.shapes = true;
    StationJob hand;
    hand.id = 3;
    hand.horizon = Micros{100'000};
    const double from = at_m;
    for (Micros t = now + kTick; t <= job.target; t += kTick)
      hand.samples.push_back(
          {t, Vec3(0.031, 0.028, kResetTop + from + (height_m - from) * seconds(t - now) / seconds(kResetFrame))});
    at_m = height_m;
    now = job.target;
    job.stations = {hand};
    return room.run(job);
  }
  FrameResult hold(double height_m, int frames) {
    FrameResult last;
    for (int k = 0; k < frames; ++k) last = frame(height_m);
    return last;
  }
};

double farthest_apart(const FrameResult& a, const FrameResult& b) {
  double far = 0;
  for (std::size_t i = 0; i < a.positions.size(); ++i) far = std::max(far, (a.positions[i] - b.positions[i]).norm());
  return far;
}

}  // namespace

TEST_CASE("A body that is reset is at rest at once and stays there, however deep a tool is in it") {
  ResetBed bed;
  const FrameResult rest = bed.frame(0.01);
  const FrameResult pressed = bed.hold(-0.008, 20);
  REQUIRE(farthest_apart(pressed, rest) > 0.003);
  CHECK(farthest_apart(bed.frame(-0.008, true), rest) < 1e-9);
  for (int k = 0; k < 20; ++k) {
    const FrameResult later = bed.frame(-0.008);
    CHECK(farthest_apart(later, rest) < 1e-9);
    CHECK_FALSE(later.stations.at(0).contact);
    CHECK(later.asleep);
  }
}

TEST_CASE("What a hand felt of a body that is reset fades to nothing, and its tool is where it is") {
  ResetBed bed;
  const double felt_n = bed.hold(-0.008, 20).stations.at(0).force.norm();
  REQUIRE(felt_n > 0.3);
  double before_n = felt_n, largest_step_n = 0;
  for (Micros faded{}; faded < 2 * ReleaseFade::kFadeTime; faded += kResetFrame) {
    const StationFrame frame = bed.frame(-0.008, faded == Micros{}).stations.at(0);
    REQUIRE(frame.patch);
    CHECK(check(*frame.patch) == PatchFault::none);
    const double force_n = frame.patch->force.norm();
    CHECK(force_n <= before_n);
    largest_step_n = std::max(largest_step_n, before_n - force_n);
    before_n = force_n;
    CHECK(frame.tool.z() == Approx(kResetTop - 0.008));
  }
  CHECK(before_n == 0);
  CHECK(largest_step_n < 0.4 * felt_n);  // six frames, along a minimum-jerk curve
}

TEST_CASE("A hand that was let go of touches again once its tool has been outside, and feels what it felt the first time") {
  ResetBed bed;
  const Vec3 first = bed.hold(-0.006, 40).stations.at(0).force;
  bed.frame(-0.006, true);
  bed.hold(-0.006, 20);
  bed.hold(0.004, 4);
  const StationFrame again = bed.hold(-0.006, 40).stations.at(0);
  CHECK(again.contact);
  CHECK((again.force - first).norm() < 0.01 * first.norm());
}

TEST_CASE("A grasp takes hold again by itself, and the node is led back to the tool") {
  ResetBed bed(ContactKind::attach);
  const Vec3 node = box_scene(ContactKind::attach).body.nodes[54];
  bed.at_m = 0;
  const auto on_node = [&](bool reset) {
    FrameJob job;
    job.begin = bed.now;
    job.target = bed.now + kResetFrame;
    job.frame = kResetFrame;
    job.reset = reset;
    StationJob hand;
    hand.id = 3;
    hand.horizon = Micros{100'000};
    for (Micros t = bed.now + kTick; t <= job.target; t += kTick) hand.samples.push_back({t, node + Vec3(0, 0, -0.005)});
    bed.now = job.target;
    job.stations = {hand};
    return bed.room.run(job).stations.at(0);
  };
  StationFrame first;
  for (int k = 0; k < 40; ++k) first = on_node(false);
  CHECK_FALSE(on_node(true).contact);
  StationFrame again;
  for (int k = 0; k < 40; ++k) again = on_node(false);
  CHECK(again.contact);
  CHECK((again.force - first.force).norm() < 0.01 * first.force.norm());
}

TEST_CASE("A hand that leaves with the very frame of a reset takes nothing with it") {
  ResetBed bed;
  const FrameResult rest = bed.frame(0.01);
  REQUIRE(farthest_apart(bed.hold(-0.008, 20), rest) > 0.003);
  FrameJob job;
  job.begin = bed.now;
  job.target = bed.now + kResetFrame;
  job.frame = kResetFrame;
  job.reset = job.shapes = true;
  CHECK(farthest_apart(bed.room.run(job), rest) < 1e-9);
}
