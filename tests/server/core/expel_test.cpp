#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("a peer whose key does not count any more is told so with an echo of its own, and nobody else notices") {
  Bench bench;
  RawStation out(bench, 1, "out"), stays(bench, 2, "stays");
  out.join();
  stays.join();
  bench.wait(20ms);
  out.say(Beat{});
  const Micros said = out.as.clock.sent;
  bench.sent.clear();
  bench.core.expel(1, bench.now);
  bench.collect();
  CHECK(bench.core.station_count() == 1);
  REQUIRE(bench.sent.size() == 1);
  const auto& [to, told] = bench.sent.front();
  CHECK(to == 1);
  CHECK(reason(told) == RefuseReason::unknown_station);
  CHECK(told.station == out.as.station);
  CHECK(told.clock.echo == said);  // without it a client would ignore the goodbye
  stays.say(Beat{});
  CHECK(bench.core.counts().unknown_station == 0);
}

TEST_CASE("a peer that is not in the room is not told that it is out") {
  Bench bench;
  bench.core.expel(7, bench.now);
  bench.collect();
  CHECK(bench.sent.empty());
}
