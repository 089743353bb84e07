// A needle that draws its thread through both lips of a wound, in a room: bites, the hand's force, knots, further bites.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <utility>

#include "common/player/player.hpp"
#include "server/body/skin.hpp"
#include "server/record/resume.hpp"
#include "server/room/drawn_threads.hpp"
#include "tests/server/room/sewing_hand.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

const std::filesystem::path kCuts = std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/cuts";
/// Of a hand that holds its needle along the y axis of the scene.
const Rotation kAlongY{Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitX())};

const SutureState::Thread& thread_of(const FrameResult& frame, std::size_t which) {
  return frame.state->sutures->threads.at(which);
}

double length_m(const FrameResult& frame, std::size_t which) {
  double sum = 0;
  for (const double length : thread_of(frame, which).length_m) sum += length;
  return sum;
}

/// Drives the needle through the ridge at this x, from y < 0 to y > 0, without a press.
FrameResult drive_through(SewingHand& hand, double x) {
  hand.begin_at({x, -0.03, 0.032});
  return hand.go({x, 0.024, 0.032}, 0.02, 4);
}

/// Draws the thread through and takes its end.
FrameResult take_thread(SewingHand& hand, double x) {
  hand.press_here();
  return hand.go({x, 0.035, 0.04}, 0.05, 4);
}

}  // namespace

TEST_CASE("A needle draws its thread through both lips of a wound, and the hand closes it by the end and ties it") {
  const Scene scene = load_scene(kCuts / "sewing.json");
  const Skin skin(scene.body);
  SewingHand hand(scene, kAlongY);
  const double x = -0.01;
  hand.begin_at({x, -0.03, 0.032});
  const FrameResult inside = hand.go({x, 0.0, 0.032}, 0.02);
  REQUIRE(inside.stations[0].needle);
  CHECK(hand.press_here().sutures.drawn_through.empty());  // its tip is still in the body
  const FrameResult out = hand.go({x, 0.024, 0.032}, 0.02, 4);
  REQUIRE(out.stations[0].needle);
  CHECK(out.stations[0].needle->tip.depth_m > out.stations[0].needle->layers.of[1].begins_m);
  const double before_m = length_m(out, 0);

  const FrameResult through = hand.press_here();
  REQUIRE(through.sutures.drawn_through == std::vector{scene.body.sutures[0].name});
  const SutureState::Thread& thread = thread_of(through, 0);
  REQUIRE(thread.bites->size() == 2);
  CHECK(thread.law.bites == 2);
  CHECK(length_m(through, 0) == Approx(before_m).epsilon(1e-12));
  CHECK(thread.length_m[0] == scene.body.sutures[0].first_tail_m);
  // A bite on each lip, just below the surface, where the needle went.
  for (std::size_t j = 0; j < 2; ++j) {
    const SutureBite& bite = (*thread.bites)[j];
    CHECK((bite.rest.y() > 0) == (j == 1));
    CHECK(bite.rest.x() == Approx(x).margin(2e-3));
    const double depth_m = -skin.nearest(0, skin.rest(), bite.rest).height_m;
    CHECK(depth_m > scene.body.sutures[0].radius_m);
    CHECK(depth_m < 4e-3);
  }
  CHECK_FALSE(through.stations[0].contact);

  const FrameResult held = hand.go({x, 0.035, 0.04}, 0.05, 4);
  CHECK(held.stations[0].contact);
  CHECK(held.stations[0].force.norm() == 0);  // slack
  const double open_m = thread_of(held, 0).length_m[1];
  const FrameResult closed = hand.go({x, 0.053, 0.083}, 0.03, 10);
  CHECK(closed.stations[0].force.norm() > 0.05);
  CHECK(thread_of(closed, 0).length_m[1] < open_m - 0.002);
  REQUIRE(closed.stations[0].patch);
  CHECK(check(*closed.stations[0].patch) == PatchFault::none);
  const PatchPlayer player(*closed.stations[0].patch);
  CHECK((player.output().force - closed.stations[0].force).norm() < 1e-9);

  const FrameResult tied = hand.press_here();
  REQUIRE(tied.sutures.tied == std::vector{scene.body.sutures[0].name});
  // The next thread is on the needle, and this one stays as it is, also from a checkpoint.
  const FrameResult later = hand.go({x, 0.06, 0.09}, 0.03, 10);
  CHECK_FALSE(later.stations[0].contact);
  CHECK(thread_of(later, 0).length_m[1] == Approx(thread_of(tied, 0).length_m[1]).margin(1e-9));
  const auto resumed = threads_of(recorded_threads(*later.state), scene.body);
  REQUIRE(resumed);
  CHECK(resumed->threads[0].length_m == thread_of(later, 0).length_m);
  CHECK(resumed->threads[0].bites->back().rest == thread_of(later, 0).bites->back().rest);
  CHECK(resumed->threads[0].law.last_tied);
  CHECK(resumed->threads[1].law.bites == 0);
  CHECK(length_m(later, 1) == Approx(before_m).epsilon(1e-12));
  drive_through(hand, 0.01);
  CHECK(hand.press_here().sutures.drawn_through == std::vector{scene.body.sutures[1].name});
}

TEST_CASE("A press while the thread is slack takes the needle again until the thread is used up, and a reset takes all back") {
  Scene scene = load_scene(kCuts / "sewing.json");
  scene.body.sutures[0].length_m[0] = 0.13;
  SewingHand hand(scene, kAlongY);
  drive_through(hand, -0.01);
  take_thread(hand, -0.01);
  const FrameResult again = hand.press_here();
  CHECK(again.sutures.tied.empty());
  const FrameResult needle = drive_through(hand, 0.0);
  REQUIRE(needle.stations[0].needle);
  const double before_m = length_m(needle, 0);
  const FrameResult second = hand.press_here();
  REQUIRE(second.sutures.drawn_through == std::vector{scene.body.sutures[0].name});
  CHECK(thread_of(second, 0).bites->size() == 4);
  CHECK(length_m(second, 0) == Approx(before_m).epsilon(1e-12));
  for (std::size_t j = 0; j < 4; ++j) CHECK((*thread_of(second, 0).bites)[j].number == j);
  take_thread(hand, 0.0);
  hand.press_here();
  drive_through(hand, 0.01);
  CHECK(hand.press_here().sutures.drawn_through.empty());  // the thread does not last for a third
  hand.reset();
  const FrameResult reset = hand.frame({0.01, 0.06, 0.09});
  CHECK(thread_of(reset, 0).law.bites == 0);
  CHECK(reset.state->sutures->threads.size() == scene.body.sutures.size());
}

TEST_CASE("The tubes of all threads have short edges, gaps in the middle of spans alone, and as many vertices as positions") {
  for (const char* name : {"wound.json", "stitches.json", "sewing.json"}) {
    CAPTURE(name);
    const Scene scene = load_scene(kCuts / name);
    const DrawnThreads threads(scene.body);
    std::vector<Vec3> at;
    threads.append(at);
    REQUIRE(at.size() == threads.vertices());
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    double longest_m = 0;
    for (const Triangle& t : threads.triangles(0))
      for (std::size_t k = 0; k < 3; ++k) {
        REQUIRE(t[k] < at.size());
        edges[std::minmax(t[k], t[(k + 1) % 3])] += t[k] < t[(k + 1) % 3] ? 1 : -1;
        longest_m = std::max(longest_m, (at[t[k]] - at[t[(k + 1) % 3]]).norm());
      }
    std::size_t open = 0;
    for (const auto& [edge, sum] : edges) open += sum != 0;
    std::size_t gaps = 0;
    for (const Suture& suture : scene.body.sutures) gaps += suture.most_bites() - 1;
    CHECK(open == 8 * gaps);
    CHECK(longest_m < 0.03);
  }
}

TEST_CASE(
    "Of two hands whose needles have come out, one alone draws a thread through, also while the force of its needle fades") {
  const Scene scene = load_scene(kCuts / "sewing.json");
  Room room(scene);
  room.start(Micros{});
  const Orientation turn{kAlongY};
  constexpr Micros kFrame{50'000};
  Micros now{};
  double y_m = -0.03;
  std::array<std::uint32_t, 2> presses{};
  const auto frame = [&](double to_m) {
    FrameJob job;
    job.begin = now;
    job.frame = kFrame;
    job.target = now + kFrame;
    for (std::size_t k = 0; k < 2; ++k) {
      StationJob station;
      station.id = static_cast<StationId>(k + 1);
      station.presses = presses[k];
      station.horizon = Micros{100'000};
      for (Micros t = now + kTick; t <= job.target; t += kTick) {
        const double part = static_cast<double>((t - now).count()) / static_cast<double>(kFrame.count());
        station.samples.push_back({t, {k == 0 ? -0.01 : 0.01, std::lerp(y_m, to_m, part), 0.032}, turn});
      }
      job.stations.push_back(station);
    }
    job.state = true;
    y_m = to_m;
    now = job.target;
    return room.run(job);
  };
  while (y_m < 0.024) frame(y_m + 0.001);
  ++presses[0];
  REQUIRE(frame(y_m).sutures.drawn_through.size() == 1);
  ++presses[1];
  const FrameResult second = frame(y_m);
  CHECK(second.sutures.drawn_through.empty());
  CHECK(thread_of(second, 0).law.bites == 2);
  for (int k = 0; k < 8; ++k) frame(y_m);
  const FrameResult held = frame(y_m);
  CHECK(held.stations[0].contact);
  CHECK(thread_of(held, 0).law.bites == 2);
}
