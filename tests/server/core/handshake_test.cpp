#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("a station joins and learns about the room") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  const auto answer = hand.ask();
  REQUIRE(std::holds_alternative<Welcome>(answer.body));
  const auto& welcome = std::get<Welcome>(answer.body);
  CHECK(answer.instance != 0);
  CHECK(answer.station != 0);
  CHECK(welcome.scene == "test");
  CHECK(welcome.rate_hz == 20);
  CHECK((welcome.home - Vec3(0.01, 0.02, 0.03)).norm() < 1e-7);
  CHECK(welcome.vertices == 400);
  CHECK(welcome.triangles == 398);
  CHECK(bench.core.station_count() == 0);
  hand.join();
  CHECK(bench.core.station_count() == 1);
}

TEST_CASE("a Hello whose answer was lost is answered again and changes nothing") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  const auto first = hand.ask();
  const auto second = hand.ask();
  hand.join();
  const auto third = hand.ask();
  for (const Message& again : {second, third}) {
    CHECK(again.station == first.station);
    CHECK(again.instance == first.instance);
  }
  CHECK(bench.core.station_count() == 1);
  CHECK(bench.core.counts().joins == 1);
}

TEST_CASE("a name that is in use is refused while its owner is heard, and given on when it is silent") {
  Bench bench;
  RawStation hand(bench, 1, "hand"), other(bench, 2, "hand");
  hand.join();
  CHECK(reason(other.ask()) == RefuseReason::name_taken);
  bench.wait(900ms);
  CHECK(reason(other.ask()) == RefuseReason::name_taken);
  bench.wait(200ms);
  other.join();
  CHECK(bench.core.station_count() == 1);
  hand.say(Beat{});  // the old owner is a stranger now
  CHECK(reason(bench.sent.back().second) == RefuseReason::unknown_station);
}

TEST_CASE("a station that leaves its name to the server gets one like it, and keeps it when its Hello comes again") {
  Bench bench;
  const auto name_given = [](RawStation& station) {
    const auto answer = station.ask();
    REQUIRE(std::holds_alternative<Welcome>(answer.body));
    station.join();
    return std::get<Welcome>(answer.body).station;
  };
  RawStation named(bench, 1, "hand"), second(bench, 2, "hand"), third(bench, 3, "hand"), back(bench, 4, "hand-2");
  for (RawStation* station : {&second, &third, &back}) station->hello.alike = true;
  CHECK(name_given(named) == "hand");
  CHECK(name_given(second) == "hand-2");
  CHECK(name_given(second) == "hand-2");
  second.hello.station = "hand-2";  // as a rejoining client asks
  CHECK(name_given(second) == "hand-2");
  CHECK(name_given(third) == "hand-3");
  CHECK(name_given(back) == "hand-4");
  CHECK(bench.core.station_count() == 4);
  RawStation strict(bench, 5, "hand-2");
  CHECK(reason(strict.ask()) == RefuseReason::name_taken);
}

TEST_CASE("a name that is as long as names may be has room for a number") {
  Bench bench;
  const std::string name(static_cast<std::size_t>(kMaxNameBytes), 'h');
  RawStation first(bench, 1, name), second(bench, 2, name);
  second.hello.alike = true;
  first.join();
  const auto answer = second.ask();
  REQUIRE(std::holds_alternative<Welcome>(answer.body));
  CHECK(std::get<Welcome>(answer.body).station == name.substr(2) + "-2");
}

TEST_CASE("a full room refuses") {
  Bench bench;
  for (int i = 0; i < kMaxStations; ++i) RawStation(bench, static_cast<PeerId>(100 + i), "s" + std::to_string(i)).join();
  RawStation late(bench, 1, "late");
  CHECK(reason(late.ask()) == RefuseReason::room_full);
  CHECK(bench.core.station_count() == static_cast<std::size_t>(kMaxStations));
}

TEST_CASE("only one station holds the node of an attach scene, shadows and viewers aside") {
  Bench bench(ContactKind::attach);
  RawStation hand(bench, 1, "hand"), second(bench, 2, "second"), shadow(bench, 3, "shadow"), eye(bench, 4, "eye");
  hand.join();
  CHECK(reason(second.ask()) == RefuseReason::node_taken);
  shadow.hello.shadow_of = "hand";
  shadow.hello.scheme = Scheme::hold;
  CHECK(std::holds_alternative<Welcome>(shadow.ask().body));
  eye.hello.role = Role::viewer;
  CHECK(std::holds_alternative<Welcome>(eye.ask().body));
  hand.say(Leave{});
  CHECK(std::holds_alternative<Welcome>(second.ask().body));
}

TEST_CASE("requests that cannot be met are refused with a reason in words") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.hello.shadow_of = "nobody";
  CHECK(reason(hand.ask()) == RefuseReason::bad_request);
  hand.hello.shadow_of = "hand";
  CHECK(reason(hand.ask()) == RefuseReason::bad_request);
  hand.hello.shadow_of.clear();
  hand.hello.order = 2 * (kMaxModes + 1);
  CHECK(reason(hand.ask()) == RefuseReason::bad_request);
  hand.hello.order = 7;
  CHECK(reason(hand.ask()) == RefuseReason::bad_request);
  hand.hello.order = 0;
  CHECK(bench.core.station_count() == 0);
}

namespace {

const ToolShape kJaw{{Vec3(0, 0, 64 * kToolStepM), 32 * kToolStepM, 3000 * kToolStepM, 4000 * kSwingStepRad}};

/// A room whose scene has a point, without a part beside the body or with one, and two further tools.
Bench with_tools(std::uint8_t parts = 0) {
  Bench bench;
  RoomInfo facts = test_facts();
  facts.coupling_n_m = 1000;
  facts.tools = {"point", {{{"grasper", kJaw}, 300}, {{"ball", {{Vec3::Zero(), 0.008}}}, 500}}};
  for (int k = 0; k < parts; ++k) facts.parts.push_back({"table", 0, 0.3, {}});
  bench.core = ServerCore(facts, {.draw = repeatable(42), .rate_hz = 20});
  return bench;
}

}  // namespace

TEST_CASE("a station gets the tool that it asks for by name, and is told what its own needs") {
  const std::uint8_t parts = GENERATE(std::uint8_t{0}, std::uint8_t{1});
  Bench bench = with_tools(parts);
  RawStation plain(bench, 1, "plain"), grasps(bench, 2, "grasps"), shadow(bench, 3, "shadow");
  grasps.hello.tool = "grasper";
  const Welcome point = std::get<Welcome>(plain.ask().body), grasper = std::get<Welcome>(grasps.ask().body);
  CHECK_FALSE(point.turns);
  CHECK_FALSE(point.jaws);
  CHECK(grasper.turns);
  CHECK(grasper.jaws);
  CHECK(grasper.coupling_n_m == (parts ? 300 : 0));
  CHECK(grasper.tool == (parts ? kJaw : ToolShape()));
  CHECK(point.coupling_n_m == (parts ? 1000 : 0));
  plain.join().live(500ms);
  grasps.join().live(500ms);
  shadow.hello.shadow_of = "grasps";
  CHECK(std::get<Welcome>(shadow.ask().body).jaws);
  REQUIRE(bench.room.jobs.back().stations.size() == 2);
  CHECK(bench.room.jobs.back().stations[0].held == 0);
  CHECK(bench.room.jobs.back().stations[1].held == 1);
  REQUIRE(bench.core.stations().size() == 2);
  CHECK(bench.core.stations()[1].tool == HeldTool{"grasper", kJaw});
}

TEST_CASE("a tool that the scene does not have is refused with the names that there are") {
  Bench bench = with_tools();
  RawStation hand(bench, 1, "hand"), eye(bench, 2, "eye");
  hand.hello.tool = "scalpel";
  const Message refused = hand.ask();
  CHECK(reason(refused) == RefuseReason::bad_request);
  CHECK(std::get<Refuse>(refused.body).message == "no tool \"scalpel\" in this scene; there is point, grasper, ball");
  hand.hello.tool = "point";
  CHECK(std::holds_alternative<Welcome>(hand.ask().body));
  eye.hello.role = Role::viewer;
  eye.hello.tool = "ball";
  CHECK(reason(eye.ask()) == RefuseReason::bad_request);
  Bench one;
  RawStation asks(one, 1, "asks");
  asks.hello.tool = "ball";
  CHECK(std::get<Refuse>(asks.ask().body).message == "no tool \"ball\" in this scene; its only tool has no name");
}

TEST_CASE("a viewer is told the body of each hand's tool") {
  Bench bench = with_tools();
  RawStation plain(bench, 1, "plain"), grasps(bench, 2, "grasps"), eye(bench, 3, "eye");
  grasps.hello.tool = "grasper";
  eye.hello.role = Role::viewer;
  plain.join().live(500ms);
  grasps.join().live(500ms);
  eye.join();
  grasps.live(1s);
  const auto message = bench.last<RoomView>(3);
  REQUIRE(message);
  const RoomView view = std::get<RoomView>(message->body);
  CHECK(shape_held(view, "plain").empty());
  CHECK(shape_held(view, "grasps") == kJaw);
}

TEST_CASE("another wire version is refused, and no answer is larger than its question") {
  Bench bench;
  Message hello;
  hello.body = Hello{"hand", Role::haptic, Scheme::port, 0, ""};
  std::array<std::byte, kMaxDatagramBytes> bytes;
  const auto size = encode(hello, bytes);
  int refused = 0;
  // The position of the version is internal to the codec: change each byte and see which change is answered as a version.
  for (std::size_t i = 0; i < size; ++i) {
    auto changed = bytes;
    changed[i] = static_cast<std::byte>(std::to_integer<int>(changed[i]) ^ 0x40);
    Message ignored;
    if (decode(std::span(changed).first(size), ignored) != WireFault::version) continue;
    bench.core.take(std::span(changed).first(size), 9, bench.now);
    bench.collect();
    REQUIRE_FALSE(bench.sent.empty());
    CHECK(reason(bench.sent.back().second) == RefuseReason::version);
    CHECK(bench.sizes.back() <= size);
    ++refused;
  }
  CHECK(refused > 0);
}

TEST_CASE("a stranger's datagram is answered with at most as many bytes, garbage not at all") {
  Bench bench;
  for (const Payload& body : {Payload(Beat{}), Payload(Samples{{{1ms, Vec3::Zero()}}}), Payload(MeshRequest{7})}) {
    Message message{42, 5, 1, {}, body};
    std::array<std::byte, kMaxDatagramBytes> bytes;
    const auto size = encode(message, bytes);
    bench.sizes.clear();
    bench.core.take(std::span(bytes).first(size), 9, bench.now);
    bench.collect();
    CAPTURE(size, body.index());
    REQUIRE(bench.sizes.size() == 1);
    CHECK(bench.sizes[0] <= size);
  }
  bench.sent.clear();
  const std::array<std::byte, 100> garbage{};
  bench.core.take(garbage, 9, bench.now);
  bench.collect();
  CHECK(bench.sent.empty());
  CHECK(bench.core.counts().dropped_all() == 1);
  CHECK(bench.core.station_count() == 0);
}

TEST_CASE("a station that never answers gets nothing but its Welcome, which is worth nothing after three seconds") {
  Bench bench;
  RawStation early(bench, 1, "early"), late(bench, 2, "late");
  for (RawStation* station : {&early, &late}) {
    const auto answer = station->ask();
    station->as.instance = answer.instance;
    station->as.station = answer.station;
  }
  bench.wait(2900ms);
  CHECK(bench.sent.empty());
  CHECK(bench.core.station_count() == 0);
  early.say(Beat{});
  CHECK(bench.core.station_count() == 1);
  bench.wait(200ms);
  late.say(Beat{});
  CHECK(bench.core.station_count() == 1);
  CHECK(reason(bench.sent.back().second) == RefuseReason::unknown_station);
}

TEST_CASE("a Hello with a former session's secret takes the place of that session, once its new address is proven") {
  Bench bench(ContactKind::attach);
  RawStation hand(bench, 1, "hand"), moved(bench, 2, "hand"), thief(bench, 3, "hand");
  hand.join();
  const auto asks_as = [&](RawStation& station, std::uint64_t instance) {
    station.as.instance = instance;
    station.as.station = hand.as.station;
    bench.sent.clear();
    station.say(station.hello);
    REQUIRE_FALSE(bench.sent.empty());
    return bench.sent.back().second;
  };
  const Message no = asks_as(thief, hand.as.instance + 1);
  CHECK(reason(no) == RefuseReason::name_taken);
  CHECK(no.station == 0);
  CHECK(no.instance == 0);
  const Message yes = asks_as(moved, hand.as.instance);
  REQUIRE(std::holds_alternative<Welcome>(yes.body));
  CHECK(yes.instance != hand.as.instance);
  CHECK(bench.core.knows({hand.as.instance, hand.as.station, 0, {}, Beat{}}, 1, bench.now));
  moved.as.instance = yes.instance;
  moved.as.station = yes.station;
  moved.say(Beat{});
  CHECK(bench.core.station_count() == 1);
  CHECK(bench.core.counts().replaced == 1);
  hand.say(Beat{});
  CHECK(reason(bench.sent.back().second) == RefuseReason::unknown_station);
}

TEST_CASE("an id counts only with the peer and the secret it was given with") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join();
  RawStation thief(bench, 2, "thief");
  thief.as = hand.as;
  thief.say(Beat{});
  CHECK(reason(bench.sent.back().second) == RefuseReason::unknown_station);
  ++hand.as.instance;
  hand.say(Beat{});
  CHECK(std::holds_alternative<Refuse>(bench.sent.back().second.body));
  CHECK(bench.core.counts().unknown_station == 2);
}

TEST_CASE("leaving frees the place at once") {
  Bench bench;
  RawStation hand(bench, 1, "hand"), other(bench, 2, "hand");
  hand.join();
  hand.say(Leave{});
  CHECK(bench.core.station_count() == 0);
  CHECK(std::holds_alternative<Welcome>(other.ask().body));
}

TEST_CASE("when the server shuts down everyone is told") {
  Bench bench;
  RawStation a(bench, 1, "a"), b(bench, 2, "b");
  a.join();
  b.join();
  bench.sent.clear();
  bench.core.shut_down(bench.now);
  bench.collect();
  REQUIRE(bench.sent.size() == 2);
  CHECK(reason(bench.sent[0].second) == RefuseReason::shutting_down);
  CHECK(bench.sent[0].second.station == a.as.station);
  CHECK(bench.sent[1].first == 2);
}

TEST_CASE("two servers of whatever versions, told of each other by a forged datagram, fall silent after one answer") {
  Bench bench;
  const auto answers_to = [&](std::span<const std::byte> datagram) {
    bench.sent.clear();
    bench.core.take(datagram, 9, bench.now);
    bench.collect();
    return bench.sent.size();
  };
  // Every reason, with the longest possible text.
  for (std::uint8_t reason = 0; reason < 32; ++reason) {
    const Message refusal{42, 5, 1, {}, Refuse{static_cast<RefuseReason>(reason), std::string(200, 'x')}};
    std::array<std::byte, kMaxDatagramBytes> bytes;
    const std::size_t size = encode(refusal, bytes);
    CHECK(answers_to(std::span(bytes).first(size)) == 0);
    // The same with another version.
    for (std::size_t i = 0; i < size; ++i) {
      auto changed = bytes;
      changed[i] = static_cast<std::byte>(std::to_integer<int>(changed[i]) ^ 0x40);
      Message ignored;
      if (decode(std::span(changed).first(size), ignored) == WireFault::version)
        CHECK(answers_to(std::span(changed).first(size)) == 0);
    }
  }
}
