// Who asks for the body to be put back to rest gets that once.
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
