// A request to reset the body is fulfilled once.
#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

int resets_in(const FakeRoom& room) {
  return static_cast<int>(std::count_if(room.jobs.begin(), room.jobs.end(), [](const FrameJob& job) { return job.reset; }));
}

}  // namespace

TEST_CASE("a request that comes again and again resets the body once, and the beat says that it is done") {
  Bench bench;
  std::vector<RecordedEvent> events;
  bench.core.on_event([&](const RecordedEvent& e) { events.push_back(e); });
  RawStation hand(bench, 1, "hand"), viewer(bench, 2, "viewer");
  viewer.hello.role = Role::viewer;
  hand.join().live();
  viewer.join();
  bench.wait(300ms);
  const auto before = bench.last<Beat>(2);
  REQUIRE(before);
  const std::uint16_t known = std::get<Beat>(before->body).resets;
  for (int k = 0; k < 3; ++k) viewer.say(Reset{known});
  hand.say(Reset{known});  // at the same time
  bench.wait(100ms);
  CHECK(resets_in(bench.room) == 1);
  const auto after = bench.last<Beat>(2);
  REQUIRE(after);
  CHECK(std::get<Beat>(after->body).resets == known + 1);
  CHECK(events.back().kind == RecordedEventKind::reset);
  CHECK(events.back().name == "viewer");
  hand.say(Reset{static_cast<std::uint16_t>(known + 1)});
  bench.wait(100ms);
  CHECK(resets_in(bench.room) == 2);
}

TEST_CASE("a stranger resets nothing") {
  Bench bench;
  RawStation stranger(bench, 1, "stranger");
  stranger.say(Reset{0});
  bench.wait(200ms);
  CHECK(resets_in(bench.room) == 0);
}

TEST_CASE("who asks for resets all the time gets two at once and two a minute, and leaves some to others") {
  Bench bench;
  RawStation greedy(bench, 1, "greedy"), other(bench, 2, "other");
  greedy.join().live();
  other.join();
  const auto count = [&] { return static_cast<std::uint16_t>(bench.core.counts().resets); };
  for (int k = 0; k < 20 * 60; ++k) {
    greedy.say(Reset{count()});
    other.say(Beat{});
    bench.wait(50ms);
  }
  CHECK(bench.core.counts().resets == 3);
  CHECK(bench.core.counts().resets_withheld > 1000);
  other.say(Reset{count()});
  bench.wait(100ms);
  CHECK(bench.core.counts().resets == 4);
}

TEST_CASE("the sessions of one key share its resets, at once or one after the other") {
  Bench bench;
  bench.core.know_keys([](PeerId peer) { return peer < 100 ? "one" : "other"; });
  const auto asks = [&bench](PeerId peer) {
    RawStation station(bench, peer, "station " + std::to_string(peer));
    station.join();
    const auto before = static_cast<std::uint16_t>(bench.core.counts().resets);
    station.say(Reset{before});
    bench.wait(100ms);
    station.say(Leave{});
    bench.wait(100ms);
    return bench.core.counts().resets - before;
  };
  CHECK(asks(1) == 1);
  CHECK(asks(2) == 1);
  CHECK(asks(3) == 0);
  CHECK(asks(4) == 0);
  CHECK(asks(101) == 1);
  bench.wait(30s);
  CHECK(asks(5) == 1);
}

TEST_CASE("a room is reset four times at once and six times a minute, whoever asks") {
  Bench bench;
  std::vector<RawStation> viewers;
  for (PeerId k = 1; k <= 8; ++k) {
    viewers.emplace_back(bench, k, "viewer " + std::to_string(k));
    viewers.back().hello.role = Role::viewer;
    viewers.back().join();
  }
  for (int k = 0; k < 20 * 30; ++k) {
    for (RawStation& viewer : viewers) viewer.say(Reset{static_cast<std::uint16_t>(bench.core.counts().resets)});
    bench.wait(50ms);
  }
  CHECK(bench.core.counts().resets >= 4 + 2);
  CHECK(bench.core.counts().resets <= 4 + 3);
}
