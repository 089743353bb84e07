// Datagrams forged in the server's name, and a server that disappears.
#include <algorithm>
#include <functional>

#include "small_world.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

/// An attacker that knows the whole session except what only the server sees, unless given.
struct Forger {
  SmallWorld& world;
  ClientCore& hand;
  std::uint64_t instance = world.newest(1).instance;
  StationId station = world.newest(1).station;
  std::uint32_t seq = 1'000'000;

  void send(Payload body, Micros echo) {
    Message message{instance, station, ++seq, {world.clock(1), echo, Micros{}}, std::move(body)};
    std::array<std::byte, kMaxDatagramBytes> bytes;
    const auto size = encode(message, bytes);
    REQUIRE(size > 0);
    hand.take(std::span(bytes).first(size), world.clock(1));
  }
  /// Clock stamp of a datagram of the hand that the attacker has seen.
  Micros seen() const { return world.places.at(1).sent; }
};

/// Outcome after the server's last datagram: the time until the force is zero, and the largest step on the way.
struct End {
  Micros after{};
  double step_n = 0;
};
End end_of_force(SmallWorld& world, const std::function<void()>& meanwhile = {}) {
  world.server.reset();
  const Micros begin = world.now;
  End end;
  Vec3 before = world.places[1].ticks.back().force;
  REQUIRE(before.norm() > 0.5);
  while (before.norm() > 0) {
    world.run(1ms);
    if (meanwhile) meanwhile();
    const Vec3 force = world.places[1].ticks.back().force;
    end.step_n = std::max(end.step_n, (force - before).norm());
    before = force;
    REQUIRE(world.now - begin < 20s);
  }
  end.after = world.now - begin;
  return end;
}

}  // namespace

TEST_CASE("a patch in the server's name that echoes nothing of ours is dropped and not felt") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(1s);
  Forger forger{world, hand};
  for (const Micros echo : {Micros{}, world.clock(1) + 1us, world.clock(1) - 10ms - 1us, Micros{1}}) {
    Patch patch = FakeRoom::patch(world.clock(1));
    patch.force = Vec3(0, 0, -8);
    patch.seq = hand.last_patch().seq + 1;
    forger.send(PatchMessage{patch}, echo);
    forger.send(Beat{world.clock(1), true, 0, {}, {}, 0, 1}, echo);
    forger.send(Refuse{RefuseReason::unknown_station, ""}, echo);
    forger.send(Refuse{RefuseReason::bad_request, "go away"}, echo);
  }
  CHECK(hand.counts().unproven == 16);
  CHECK(hand.link() == LinkState::joined);
  world.run(1s);
  for (const auto& tick : world.places[1].ticks) REQUIRE(tick.force.z() >= 0);
  CHECK(world.places[1].ticks.back().force.z() == 1);
  CHECK(hand.counts().joins == 1);
}

TEST_CASE("a client that waits is not refused by who has not seen its question") {
  SmallWorld world;
  world.server.reset();
  auto& hand = world.add(1, "hand");
  world.run(1s);
  Forger forger{world, hand, 555, 0};
  forger.send(Refuse{RefuseReason::bad_request, "go away"}, world.clock(1) - 3ms - 1us);
  Welcome welcome;
  welcome.scene = "a trap";
  welcome.rate_hz = 20;
  forger.send(welcome, world.clock(1) - 3ms - 1us);
  CHECK(hand.link() == LinkState::joining);
  CHECK(hand.counts().unproven == 2);
}

TEST_CASE("a patch whose number leads further than patches can have been made is refused, and the next genuine one plays") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(1s);
  Forger forger{world, hand};
  const Micros echo = forger.seen();
  for (const std::uint32_t lead : {std::uint32_t{12}, std::uint32_t{1000}, (std::uint32_t{1} << 31) - 1}) {
    Patch patch = FakeRoom::patch(world.clock(1));
    patch.force = Vec3(0, 0, -8);
    patch.seq = hand.last_patch().seq + lead;
    patch.valid_for = 60s;
    forger.send(PatchMessage{patch}, echo);
  }
  CHECK(hand.intake_counts().jumped == 3);
  CHECK(hand.counts().unproven == 0);
  world.run(500ms);
  for (const auto& tick : world.places[1].ticks) REQUIRE(tick.force.z() >= 0);
  CHECK(world.places[1].ticks.back().patch_age < 100ms);
}

TEST_CASE("one patch by somebody who sees the datagrams is wrong for less than a second") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(1s);
  Forger forger{world, hand};
  Patch patch = FakeRoom::patch(world.clock(1));
  patch.force = Vec3(0, 0, -8);
  patch.seq = hand.last_patch().seq + PatchIntake::kJumpFree;
  patch.valid_for = 60s;
  forger.send(PatchMessage{patch}, forger.seen());
  world.run(1s);
  const auto wrong = std::count_if(world.places[1].ticks.begin(), world.places[1].ticks.end(),
                                   [](const TickOutput& tick) { return tick.force.z() < 0; });
  CHECK(wrong > 0);
  CHECK(wrong < 1000);
  CHECK(world.places[1].ticks.back().force.z() == Approx(1));
}

TEST_CASE("patches that were lost for a while do not count as a jump, at any rate") {
  for (const double loss : {0.5, 0.9}) {
    SmallWorld world;
    world.link.loss = loss;
    auto& hand = world.add(1, "hand");
    world.run(20s);
    CHECK(hand.intake_counts().jumped == 0);
    CHECK(hand.intake_counts().accepted > 30);
  }
}

TEST_CASE("when the server dies the force is gone within 0.35 s, however long its way was, without a step") {
  for (const Micros delay : {Micros{}, Micros{40ms}, Micros{750ms}}) {
    SmallWorld world;
    world.link.delay = delay;
    world.room.valid_for = 4s;
    world.add(1, "hand");
    world.run(10s);
    const End end = end_of_force(world);
    CHECK(end.after <= delay + 351ms);
    CHECK(end.step_n < 0.05);
  }
}

TEST_CASE("beats of somebody else do not keep the force of a dead server alive, and of one who sees the datagrams not for long") {
  const bool sees = GENERATE(false, true);
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(2s);
  Forger forger{world, hand};
  const Micros echo = sees ? forger.seen() : world.clock(1) + 1us;
  const End end = end_of_force(world, [&] {
    Beat beat{world.clock(1), true, 20, {}, {}, 0, 1};
    forger.send(beat, echo);
  });
  // With a seen echo: 1 s after its stamp, and for as long as the patch was valid.
  CHECK(end.after <= (sees ? kRenewedMost + FakeRoom::patch({}).valid_for + 51ms : 351ms));
}

TEST_CASE("a server that refuses a station that it does not know is left at once, and so is the force of its patch") {
  SmallWorld world;
  world.link.delay = 200ms;
  auto& hand = world.add(1, "hand");
  world.run(3s);
  world.start_server(2);
  Micros begin{};
  for (int ms = 0; ms < 2000 && hand.counts().joins == 1; ++ms) {
    world.run(1ms);
    if (begin == Micros{} && hand.link() == LinkState::joining) begin = world.now;
    if (begin != Micros{} && world.now > begin + 51ms) REQUIRE(world.places[1].ticks.back().force.norm() == 0);
  }
  REQUIRE(begin != Micros{});
  CHECK(hand.counts().joins == 2);
  world.run(1s);
  CHECK(world.places[1].ticks.back().force.z() == Approx(1));
}

TEST_CASE("a station of which its server thinks as of another joins anew") {
  SmallWorld world;
  auto& hand = world.add(1, "hand");
  world.run(1s);
  // Datagrams in the hand's name, by an attacker that sees its datagrams, for 4 s and always a little ahead: the server's echoes
  // refer to datagrams that the hand never sent.
  const Message real = world.newest(1);
  for (int ms = 0; ms < 4000; ++ms) {
    std::array<std::byte, kMaxDatagramBytes> bytes;
    const Message poison{real.instance, real.station, 7, {world.now + 15s, {}, {}}, Beat{}};
    world.server->take(std::span(bytes).first(encode(poison, bytes)), 1, world.now);
    world.run(1ms);
  }
  world.run(2s);
  CHECK(hand.counts().unproven > 0);
  CHECK(hand.counts().joins == 2);
  CHECK(hand.link() == LinkState::joined);
  CHECK(world.places[1].ticks.back().force.z() == Approx(1));
}

TEST_CASE("the longest pause is that of the last ten to twenty seconds") {
  LongestPause pause;
  Micros t = 5s;
  for (int k = 0; k < 10; ++k) pause.take(t += 50ms);
  CHECK(pause.longest() == 50ms);
  pause.take(t += 400ms);
  CHECK(pause.longest() == 400ms);
  for (const Micros end = t + 9s; t < end;) pause.take(t += 50ms);
  CHECK(pause.longest() == 400ms);
  for (const Micros end = t + 12s; t < end;) pause.take(t += 50ms);
  CHECK(pause.longest() == 50ms);
}
