// Shutdown of a server: newcomers are refused, existing sessions stay, and goodbyes are repeated on request.
#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("a room that drains refuses newcomers with the reason, and serves whoever is there") {
  Bench bench;
  RawStation hand(bench, 1, "hand"), late(bench, 2, "late"), newcomer(bench, 3, "newcomer");
  hand.join();
  const Message welcome = late.ask();  // granted, and not proven yet
  CHECK_FALSE(bench.core.draining());
  bench.core.drain();
  CHECK(bench.core.draining());
  const Message answer = newcomer.ask();
  CHECK(reason(answer) == RefuseReason::shutting_down);
  CHECK(answer.station == 0);
  late.as.instance = welcome.instance;
  late.as.station = welcome.station;
  late.say(Beat{});
  CHECK(bench.core.station_count() == 1);
  bench.sent.clear();
  hand.live();
  CHECK(bench.last<PatchMessage>(1));
  CHECK(bench.core.has_hands());
  hand.say(Leave{});
  CHECK_FALSE(bench.core.has_hands());
  CHECK(bench.core.counts().refused[static_cast<std::size_t>(RefuseReason::shutting_down)] == 1);
}

TEST_CASE("a viewer does not keep a room from being empty") {
  Bench bench;
  RawStation viewer(bench, 1, "viewer");
  viewer.hello.role = Role::viewer;
  viewer.join();
  CHECK(bench.core.station_count() == 1);
  CHECK_FALSE(bench.core.has_hands());
}

TEST_CASE("a goodbye is said again with the station's own numbers, and who heard it does not get back in") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  bench.sent.clear();
  bench.core.drain();
  bench.core.shut_down(bench.now);
  bench.core.repeat_goodbyes(bench.now);
  bench.core.repeat_goodbyes(bench.now);
  CHECK(bench.core.serves(1));  // its address is still needed
  bench.collect();
  REQUIRE(bench.sent.size() == 3);
  for (const auto& [to, message] : bench.sent) {
    CHECK(to == 1);
    CHECK(reason(message) == RefuseReason::shutting_down);
    CHECK(message.instance == hand.as.instance);
    CHECK(message.station == hand.as.station);
    CHECK(message.clock.echo == hand.clock());  // echo of the newest datagram that it sent
  }
  CHECK(reason(hand.ask()) == RefuseReason::shutting_down);
  CHECK(bench.core.counts().goodbyes_sent == 1);
}
