// Begin and extent of frames, by FrameScheduler and playout() alone: stations are plain values here.
#include "server/core/frame_scheduler.hpp"

#include <catch2/catch.hpp>

#include "fake_room.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

constexpr Micros kBegin{10'000'000};

/// A hand whose samples of every millisecond up to `newest` came `lag` after they were taken; its clock is the server's.
Station hand(StationId id, Micros newest, Micros lag) {
  Station station;
  station.id = id;
  station.clock.take({newest - 60ms, newest - 60ms, Micros{0}}, newest - 60ms);
  REQUIRE(station.clock.locked());
  for (Micros t = newest - 50ms; t <= newest; t += 1ms)
    station.tool.take(Samples{{{t, Vec3::Zero()}}}, station.clock, Micros{}, t + lag, [](const ButtonChange&) {});
  return station;
}

}  // namespace

TEST_CASE("A frame goes up to now with nobody there, and up to the newest sample of a station alone") {
  Stations stations;
  CHECK(playout(stations, kBegin, kBegin + 50ms) == kBegin + 50ms);
  stations[1] = hand(1, kBegin + 30ms, 5ms);
  CHECK(playout(stations, kBegin, kBegin + 50ms) == kBegin + 30ms);
  CHECK(playout(stations, kBegin - 10s, kBegin + 50ms) == kBegin - 10s + kLongestFrame);
}

TEST_CASE("With two hands a frame waits for the slower one, by at most 20 ms beyond the quicker one's buffer") {
  Stations stations;
  stations[1] = hand(1, kBegin + 49ms, 1ms);
  stations[2] = hand(2, kBegin + 41ms, 9ms);
  CHECK(playout(stations, kBegin, kBegin + 50ms) == kBegin + 41ms);
  stations[2] = hand(2, kBegin - 30ms, 80ms);
  CHECK(playout(stations, kBegin, kBegin + 50ms) == kBegin + 50ms - stations[1].tool.buffer() - kMostWait);
}

TEST_CASE("Hands that are all late move the body on at the lag of the least late one") {
  Stations stations;
  stations[1] = hand(1, kBegin, 40ms);
  stations[2] = hand(2, kBegin, 70ms);
  CHECK(playout(stations, kBegin, kBegin + 300ms) == kBegin + 260ms);
}

TEST_CASE("The scheduler has a job out at most once, owes the frame that fell due meanwhile, and skips those between") {
  Stations stations;
  FrameScheduler frames(ContactKind::touch, ServerOptions{.draw = {}, .rate_hz = 20});
  CHECK_FALSE(frames.tick(stations, kBegin));  // the body is there already
  CHECK_FALSE(frames.next_job(kBegin));
  CHECK(frames.tick(stations, kBegin + 50ms));
  REQUIRE(frames.next_job(kBegin + 50ms));
  CHECK(frames.tick(stations, kBegin + 60ms));
  CHECK_FALSE(frames.tick(stations, kBegin + 100ms));
  CHECK_FALSE(frames.tick(stations, kBegin + 150ms));
  CHECK_FALSE(frames.next_job(kBegin + 150ms));
  FrameResult done;
  done.stamp = kBegin + 50ms;
  done.steps = 1;
  frames.finish(done, stations, kBegin + 160ms);
  CHECK(frames.deadline(stations) == Micros{});
  CHECK(frames.tick(stations, kBegin + 160ms));
  const auto late = frames.next_job(kBegin + 160ms);
  REQUIRE(late);
  CHECK(late->begin == kBegin + 50ms);
  CHECK(late->target == kBegin + 160ms);
  CHECK(frames.counts().frames_busy == 1);
  CHECK(frames.pace().behind == 110ms);
}

TEST_CASE("A reset that knows another count than the scheduler's was done before") {
  FrameScheduler frames(ContactKind::touch, ServerOptions{.draw = {}, .rate_hz = 20});
  CHECK(frames.is_new_reset(0));
  frames.reset();
  CHECK_FALSE(frames.is_new_reset(0));
  CHECK(frames.is_new_reset(1));
  frames.reset();
  CHECK(frames.counts().resets == 2);
  Stations stations;
  CHECK_FALSE(frames.tick(stations, kBegin));
  CHECK(frames.tick(stations, kBegin + 50ms));
  const auto job = frames.next_job(kBegin + 50ms);
  REQUIRE(job);
  CHECK(job->reset);
}
