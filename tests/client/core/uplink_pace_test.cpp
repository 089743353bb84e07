// The uplink adapts to losses.
#include "client/core/uplink_pace.hpp"

#include "small_world.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("until the server has said anything the link counts as bad") {
  UplinkPace pace;
  CHECK(pace.interval() == UplinkPace::kBusy);
  CHECK(pace.repeat() == UplinkPace::kRepeatUnknown);
  pace.take({10, 0, 0, {}}, 1s);  // too few to judge by
  CHECK(pace.interval() == UplinkPace::kBusy);
}

TEST_CASE("a calm link is sent half as many datagrams, and what is repeated covers the longest run of losses") {
  UplinkPace pace;
  pace.take({1000, 0, 0, {}}, 1s);
  CHECK(pace.interval() == UplinkPace::kCalm);
  CHECK(pace.repeat() == UplinkPace::kRepeatLeast);
  for (const int run : {1, 4, 10, 500}) {
    pace.take({1000, 400, static_cast<std::uint16_t>(run), {}}, 2s);
    CHECK(pace.interval() == UplinkPace::kBusy);
    CHECK((pace.repeat() >= 2 * (run + 1) || pace.repeat() == UplinkPace::kRepeatMost));
  }
}

TEST_CASE("A link that drowns in what it is sent is sent as little as a calm one, and what gets through decides afterwards") {
  UplinkPace pace;
  pace.take({1000, 700, 40, {}}, 1s);
  CHECK(pace.interval() == UplinkPace::kCalm);
  CHECK(pace.repeat() == UplinkPace::kRepeatLeast);
  pace.take({1000, 50, 2, {}}, 12s);
  CHECK(pace.interval() == UplinkPace::kBusy);
}

TEST_CASE("losses are believed at once and forgotten after ten seconds without") {
  UplinkPace pace;
  pace.take({1000, 50, 6, {}}, 1s);
  const int repeat = pace.repeat();
  for (auto t = 2s; t < 11s; t += 1s) pace.take({1000, 0, 0, {}}, t);
  CHECK(pace.repeat() == repeat);
  CHECK(pace.interval() == UplinkPace::kBusy);
  pace.take({1000, 0, 0, {}}, 12s);
  CHECK(pace.interval() == UplinkPace::kCalm);
}

TEST_CASE("a link that calms down is soon sent half the bytes, and one that turns bad loses no sample for it") {
  SmallWorld world;
  world.link = {20ms, 0ms, 0.2, 0.0};
  auto& hand = world.add(1, "hand");
  world.run(3s);
  CHECK(hand.uplink_pace().interval() == UplinkPace::kBusy);
  const auto bytes_in = [&](Micros time) {
    const auto before = hand.counts().bytes_sent;
    world.run(time);
    return hand.counts().bytes_sent - before;
  };
  const auto bad = bytes_in(2s);
  world.link.loss = 0;
  world.run(15s);
  CHECK(hand.uplink_pace().interval() == UplinkPace::kCalm);
  const auto calm = bytes_in(2s);
  INFO(bad << " and " << calm << " bytes in 2 s");
  CHECK(2 * calm < bad);

  world.link.loss = 0.2;
  world.run(1s);  // for the server to report
  const auto before = world.server->stations()[0].counts.samples;
  world.run(10s);
  const auto got = world.server->stations()[0].counts.samples - before;
  CHECK(got >= 9980);
  CHECK(world.server->stations()[0].counts.patches > 100);
}

TEST_CASE("a station says how old its patches get, and they are made for that horizon") {
  SmallWorld world;
  world.link = {40ms, 0ms, 0.0, 0.0};
  world.add(1, "hand");
  world.run(5s);
  const auto expected = 80ms + 50ms;  // round trip and frame
  const Micros calm = world.server->stations()[0].horizon;
  CHECK(calm >= expected);
  CHECK(calm <= expected + 30ms);
  world.link = {40ms, 30ms, 0.3, 0.0};
  world.run(10s);
  const Micros shaky = world.server->stations()[0].horizon;
  INFO(calm.count() << " us, then " << shaky.count() << " us");
  CHECK(shaky > calm + 30ms);
  CHECK(shaky < 1s);
}
