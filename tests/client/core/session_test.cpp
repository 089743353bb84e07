#include "small_world.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("a client joins, moves and feels patches of its own past") {
  SmallWorld world;
  world.link.delay = 40ms;
  auto& hand = world.add(1, "hand", -77s);
  CHECK(hand.link() == LinkState::joining);
  world.run(2s);
  CHECK(hand.link() == LinkState::joined);
  CHECK(hand.counts().joins == 1);
  CHECK(hand.welcome().scene == "test");
  CHECK(hand.clock().rtt().min == 80ms);
  CHECK(hand.clock().offset() == 77s);
  CHECK(hand.counts().patches > 30);
  CHECK(hand.intake_counts().accepted + hand.intake_counts().stale == hand.counts().patches);
  CHECK(hand.intake_counts().stale <= hand.counts().patches / 2);  // second copies
  CHECK(hand.loss().lost == 0);
  CHECK(hand.contact_in_reach());
  const auto& tick = world.places[1].ticks.back();
  CHECK(tick.has_patch);
  CHECK(tick.patch_age >= 80ms);
  CHECK(tick.patch_age <= 80ms + 50ms + 3ms);
}

TEST_CASE("every stamp is the time of a sample, to the microsecond, over a bad link") {
  SmallWorld world;
  world.link = {60ms, 20ms, 0.05, 0.02};
  auto& hand = world.add(1, "hand", 1234567us);
  world.run(1s);
  Micros last{};
  int patches = 0;
  for (int i = 0; i < 10'000; ++i) {
    world.run(1ms);
    const auto stamp = hand.last_patch().stamp;
    if (stamp == last) continue;
    REQUIRE(stamp > last);
    last = stamp;
    ++patches;
    const auto off = (stamp - world.clock(1)) % 1ms;  // samples lie a whole number of milliseconds back
    REQUIRE(std::abs(off.count()) <= 1);
  }
  CHECK(patches > 150);
  CHECK(hand.loss().lost > 0);
  CHECK(hand.loss().duplicates > 0);
  CHECK(world.server->stations()[0].link.lost > 0);
}

TEST_CASE("a client knows while the server keeps its tool off the body, with patches and without, and not from a server before") {
  SmallWorld world;
  world.link = {20ms, 5ms, 0.1, 0};
  ClientCore& core = world.add(1, "hand");
  for (const bool patches : {true, false}) {
    world.room.in_reach = patches;
    world.run(2s);
    CHECK_FALSE(core.tool_released());
    world.room.keeps_off = true;
    world.run(1s);
    CHECK(core.tool_released());
    world.room.keeps_off = false;
    world.run(1s);
    CHECK_FALSE(core.tool_released());
  }
  world.room.keeps_off = true;
  world.run(1s);
  REQUIRE(core.tool_released());
  world.room.keeps_off = false;
  world.start_server(2);
  world.run(1s);
  CHECK(core.counts().joins == 2);
  CHECK_FALSE(core.tool_released());
}

TEST_CASE("a lost datagram costs no sample") {
  SmallWorld world;
  world.link = {20ms, 5ms, 0.10, 0.0};
  world.add(1, "hand");
  world.run(1s);
  const auto before = world.server->stations()[0].counts.samples;
  world.run(5s);
  const auto got = world.server->stations()[0].counts.samples - before;
  CHECK(got >= 4990);
  CHECK(got <= 5010);
}

TEST_CASE("a client keeps asking until there is a server, and feels nothing meanwhile") {
  SmallWorld world;
  world.server.reset();
  auto& hand = world.add(1, "hand");
  world.run(5s);
  CHECK(hand.link() == LinkState::joining);
  CHECK(hand.counts().sent == 20);
  for (const auto& tick : world.places[1].ticks) REQUIRE(tick.force == Vec3::Zero());
  world.start_server(9);
  world.run(500ms);
  CHECK(hand.link() == LinkState::joined);
}

TEST_CASE("a server that restarts is joined again at once and its patches count although they start over") {
  SmallWorld world;
  world.link.delay = 10ms;
  auto& hand = world.add(1, "hand");
  world.run(3s);
  const auto patches = hand.intake_counts().accepted;
  CHECK(patches > 40);
  world.start_server(2);
  world.run(300ms);
  CHECK(hand.link() == LinkState::joined);
  CHECK(hand.counts().joins == 2);
  world.run(1s);
  CHECK(world.places[1].ticks.back().has_patch);
  CHECK(world.places[1].ticks.back().patch_age < 100ms);
}

TEST_CASE("a server that vanishes is missed after three seconds and joined when it is back") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(1s);
  auto asleep = std::move(world.server);
  world.run(2900ms);
  CHECK(hand.link() == LinkState::joined);
  world.run(200ms);
  CHECK(hand.link() == LinkState::joining);
  CHECK(world.places[1].ticks.back().force.norm() == 0);
  world.server = std::move(asleep);
  world.run(500ms);
  CHECK(hand.link() == LinkState::joined);
}

TEST_CASE("a name that is taken is refused, said, and had once it is free") {
  SmallWorld world;
  auto& first = world.add(1, "hand");
  world.run(500ms);
  auto& second = world.add(2, "hand");
  world.run(2s);
  CHECK(first.link() == LinkState::joined);
  CHECK(second.link() == LinkState::refused);
  CHECK(second.refuse_reason() == RefuseReason::name_taken);
  CHECK_FALSE(second.refusal().empty());
  CHECK(second.counts().sent <= 4);
  first.leave();
  world.run(1500ms);
  CHECK(second.link() == LinkState::joined);
  CHECK(world.server->counts().leaves == 1);
  CHECK(world.server->station_count() == 1);
}

TEST_CASE("a hand that leaves its name to the server gets one like it, and asks for that when the server restarts") {
  SmallWorld world;
  auto& first = world.add(1, "hand");
  world.run(500ms);
  ClientOptions options;
  options.hello.station = "hand";
  options.hello.alike = true;
  auto& second = world.add(2, options);
  world.run(500ms);
  REQUIRE(second.link() == LinkState::joined);
  CHECK(second.welcome().station == "hand-2");
  first.leave();
  world.run(300ms);
  world.start_server(2);
  world.run(500ms);
  CHECK(second.link() == LinkState::joined);
  CHECK(second.counts().joins == 2);
  CHECK(second.welcome().station == "hand-2");
}

TEST_CASE("a client whose address changes keeps its name, is back at once, and never has two tools in the body") {
  for (const bool alike : {false, true}) {
    SmallWorld world;
    world.link.delay = 20ms;
    ClientOptions options;
    options.hello.station = "hand";
    options.hello.alike = alike;
    auto& hand = world.add(1, options);
    world.run(2s);
    const auto before = world.room.jobs.size();
    auto moved = world.places.extract(1);
    moved.key() = 7;
    world.places.insert(std::move(moved));
    world.run(150ms);
    CAPTURE(alike);
    CHECK(hand.link() == LinkState::joined);
    CHECK(hand.counts().joins == 2);
    CHECK(hand.welcome().station == "hand");
    CHECK(world.server->station_count() == 1);
    world.run(4s);
    CHECK(hand.counts().joins == 2);
    CHECK(world.places[7].ticks.back().has_patch);
    for (std::size_t k = before; k < world.room.jobs.size(); ++k) REQUIRE(world.room.jobs[k].stations.size() <= 1);
  }
}

TEST_CASE("only one hand holds the node of an attach scene") {
  SmallWorld world(ContactKind::attach);
  world.add(1, "a");
  world.run(300ms);
  auto& b = world.add(2, "b");
  world.run(300ms);
  CHECK(b.link() == LinkState::refused);
  CHECK(b.refuse_reason() == RefuseReason::node_taken);
}

TEST_CASE("a server that shuts down says so and the client waits for the next") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(500ms);
  CHECK_FALSE(hand.sent_away());
  CHECK(hand.last_answer() > world.clock(1) - 100ms);
  world.server->shut_down(world.now);
  world.run(2ms);
  CHECK(hand.sent_away());
  const Micros sent_away = hand.last_answer();
  world.run(8ms);
  CHECK(hand.link() != LinkState::refused);
  world.run(1s);
  CHECK(hand.link() == LinkState::joined);
  CHECK_FALSE(hand.sent_away());
  CHECK(hand.last_answer() > sent_away);
  CHECK(hand.counts().joins == 2);
}

TEST_CASE("a server that drains keeps its hand, and its goodbye ends the force within 50 ms, also where two of three get lost") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(2s);
  world.server->drain();
  auto& newcomer = world.add(2, "newcomer");
  world.run(1s);
  CHECK(hand.link() == LinkState::joined);
  CHECK(newcomer.link() == LinkState::refused);
  CHECK(newcomer.refuse_reason() == RefuseReason::shutting_down);
  CHECK(newcomer.refusal() == "the server is shutting down");
  const auto& ticks = world.places[1].ticks;
  REQUIRE(ticks.back().force.norm() > 0);
  world.server->shut_down(world.now);
  world.link.loss = 1;
  world.run(20ms);
  world.server->repeat_goodbyes(world.now);
  world.run(20ms);
  CHECK(ticks.back().has_patch);
  world.link.loss = 0;
  world.server->repeat_goodbyes(world.now);
  world.run(3ms);
  const double begun = ticks.back().force.norm();
  for (int k = 0; k < 50; ++k) {
    const Vec3 before = ticks.back().force;
    world.run(1ms);
    CHECK((ticks.back().force - before).norm() <= 3 * begun / 50);
  }
  CHECK(ticks.back().force == Vec3::Zero());
  CHECK(hand.link() == LinkState::refused);
  world.start_server(2);
  world.run(kRetryEvery + 100ms);
  CHECK(hand.link() == LinkState::joined);
  CHECK(newcomer.link() == LinkState::joined);
}

TEST_CASE("a shadow sends no samples and gets the stamps of the hand") {
  SmallWorld world;
  world.link = {50ms, 10ms, 0.03, 0.0};
  auto& hand = world.add(1, "hand", 3s);
  auto& shadow = world.add(2, "hand/hold", 3s, "hand");
  world.run(4s);
  CHECK(shadow.link() == LinkState::joined);
  CHECK(shadow.intake_counts().accepted > 30);
  CHECK(world.server->stations()[1].counts.samples == 0);
  CHECK(shadow.counts().bytes_sent * 10 < hand.counts().bytes_sent);
  CHECK((shadow.last_patch().stamp - world.clock(2)) % 1ms == 0ms);
}

TEST_CASE("a shadow whose patches are ahead of its clock stays joined") {
  SmallWorld world;
  world.add(1, "hand", 3s);
  auto& shadow = world.add(2, "hand/hold", 3s - 100ms, "hand");
  world.run(8s);
  REQUIRE(world.places[2].ticks.back().patch_age < 0ms);
  CHECK(shadow.counts().joins == 1);
  CHECK(world.server->counts().timeouts == 0);
}

TEST_CASE("a client without samples stays joined by beats") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.places[1].moves = false;
  world.run(10s);
  CHECK(hand.link() == LinkState::joined);
  CHECK(hand.counts().joins == 1);
  CHECK(world.server->counts().timeouts == 0);
}

TEST_CASE(
    "samples go out every 4 ms over a calm link, each datagram repeating older ones, never more than it holds, and a beat now "
    "and then") {
  SmallWorld world;
  world.add(1, "hand");
  world.run(1s);
  auto& core = *world.places[1].core;
  const auto sent = core.counts().sent;
  world.run(1s);
  CHECK(core.counts().sent - sent == 250 + 4);
  // The network thread sleeps for a quarter of a second; everything is sent in the next round.
  std::array<std::byte, kMaxDatagramBytes> bytes;
  auto t = world.clock(1);
  for (int i = 0; i < 250; ++i) core.haptic().tick({t += 1ms, Vec3::Zero()});
  core.tick(t);
  std::vector<ToolSample> got;
  while (const auto size = core.emit(bytes, t)) {
    Message message;
    REQUIRE(decode(std::span(bytes).first(size), message) == WireFault::none);
    const auto* samples = std::get_if<Samples>(&message.body);
    if (!samples) continue;
    for (const auto& sample : samples->samples)
      if (got.empty() || sample.t > got.back().t) got.push_back(sample);
  }
  REQUIRE(got.size() >= 250);
  for (std::size_t i = 1; i < got.size(); ++i) CHECK(got[i].t - got[i - 1].t == 1ms);
  CHECK(got.back().t == t);
}

TEST_CASE("deadlines lie ahead after each tick and a client driven by them alone stays in time") {
  SmallWorld world;
  world.add(1, "hand");
  world.run(300ms);
  auto& core = *world.places[1].core;
  auto t = world.clock(1);
  for (int i = 0; i < 1000; ++i) {
    core.tick(t);
    std::array<std::byte, kMaxDatagramBytes> bytes;
    while (core.emit(bytes, t) > 0) continue;
    REQUIRE(core.deadline() > t);
    t = core.deadline();
  }
}

TEST_CASE("what is not from our server is dropped and counted") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(500ms);
  const auto t = world.clock(1);
  std::array<std::byte, kMaxDatagramBytes> bytes{};
  hand.take(std::span(bytes).first(40), t);
  CHECK(hand.counts().dropped[static_cast<std::size_t>(WireFault::not_palpate)] == 1);
  const Message stranger{555, 1, 0, {}, PatchMessage{FakeRoom::patch(t)}};
  hand.take(std::span(bytes).first(encode(stranger, bytes)), t);
  const Message refusal{555, 99, 0, {}, Refuse{RefuseReason::unknown_station, ""}};
  hand.take(std::span(bytes).first(encode(refusal, bytes)), t);
  const Message late{1, 1, 0, {}, Refuse{RefuseReason::name_taken, "late"}};
  hand.take(std::span(bytes).first(encode(late, bytes)), t);
  CHECK(hand.counts().stale == 1);
  CHECK(hand.counts().unproven == 2);
  const ClockStamps echoing{world.now, world.places[1].sent, {}};
  for (const Message& answer : {Message{555, 99, 0, echoing, Refuse{RefuseReason::unknown_station, ""}},
                                Message{1, 1, 0, echoing, Refuse{RefuseReason::name_taken, "late"}}})
    hand.take(std::span(bytes).first(encode(answer, bytes)), t);
  CHECK(hand.counts().stale == 3);
  CHECK(hand.link() == LinkState::joined);
}

TEST_CASE("a patch that the check refuses is counted, and is no loss of the link") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(500ms);
  const auto t = world.clock(1);
  const Message newest = world.newest(1);
  Patch stiff = FakeRoom::patch(t);
  stiff.force.x() = 1e9;
  REQUIRE(check(stiff) != PatchFault::none);
  const auto before = hand.loss();
  std::array<std::byte, kMaxDatagramBytes> bytes{};
  std::uint32_t seq = newest.seq;
  for (int k = 0; k < 10; ++k) {
    const ClockStamps echoing{world.now, world.places[1].sent, {}};
    hand.take(std::span(bytes).first(encode({newest.instance, newest.station, ++seq, echoing, PatchMessage{stiff}}, bytes)), t);
  }
  CHECK(hand.counts().dropped[static_cast<std::size_t>(WireFault::patch_refused)] == 10);
  CHECK(hand.loss().lost == before.lost);
  CHECK(hand.loss().received == before.received + 10);
}

TEST_CASE("a tool that is nowhere is neither sent nor played") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(500ms);
  const auto samples = world.server->stations()[0].counts.samples;
  hand.haptic().tick({world.clock(1) + 500us, Vec3(std::nan(""), 0, 0)});
  hand.haptic().tick({world.clock(1) + 600us, Vec3(1e6, 0, 0)});
  world.run(100ms);
  CHECK(hand.counts().samples_outside == 2);
  CHECK(world.server->stations()[0].counts.samples - samples <= 101);
  CHECK(hand.link() == LinkState::joined);
}

TEST_CASE("two runs with the same seed are the same") {
  const auto run = [] {
    SmallWorld world;
    world.link = {30ms, 25ms, 0.1, 0.1};
    world.add(1, "a");
    world.add(2, "b", 5s);
    world.run(3s);
    std::vector<Micros> stamps;
    for (const auto& job : world.room.jobs) stamps.push_back(job.target);
    stamps.push_back(Micros{static_cast<std::int64_t>(world.places[2].core->counts().bytes_received)});
    return stamps;
  };
  CHECK(run() == run());
}
