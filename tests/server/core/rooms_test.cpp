// Several rooms behind one socket, and a room with too little time.
#include "server/core/server_rooms.hpp"

#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

struct Rooms {
  ServerRooms rooms{{{"cube", test_facts(ContactKind::attach)}, {"organ", test_facts(ContactKind::touch)}}, repeatable(100), 20};
  Micros now{5'000'000};

  Rooms() { rooms.tick(now); }
  Message ask(PeerId from, const Message& question) {
    std::array<std::byte, kMaxDatagramBytes> bytes;
    const auto size = encode(question, bytes);
    REQUIRE(size > 0);
    rooms.take(std::span(bytes).first(size), from, now);
    PeerId to = 0;
    Message answer;
    std::size_t answers = 0;
    while (const auto answered = rooms.emit(bytes, to, now)) {
      REQUIRE(decode(std::span(bytes).first(answered), answer) == WireFault::none);
      CHECK(to == from);
      ++answers;
    }
    REQUIRE(answers == 1);
    return answer;
  }
  /// Sends as the station that `welcome` describes.
  void say(PeerId from, const Message& welcome, Payload body) {
    std::array<std::byte, kMaxDatagramBytes> bytes;
    const Message message{welcome.instance, welcome.station, 1, {}, std::move(body)};
    rooms.take(std::span(bytes).first(encode(message, bytes)), from, now);
  }
  Message hello(PeerId from, const std::string& name, const std::string& room) {
    Message message;
    Hello hello;
    hello.station = name;
    hello.room = room;
    message.body = hello;
    return ask(from, message);
  }
};

}  // namespace

TEST_CASE("A station gets the room it names, the first when it names none, and a list when there is no such room") {
  Rooms world;
  const Message organ = world.hello(1, "a", "organ"), cube = world.hello(2, "a", "cube");
  world.say(1, organ, Beat{});
  world.say(2, cube, Beat{});
  const Message none = world.hello(3, "b", "");
  CHECK(std::get<Welcome>(organ.body).contact == ContactKind::touch);
  CHECK(cube.instance != organ.instance);
  CHECK(reason(none) == RefuseReason::node_taken);  // the first room is the cube, whose node "a" holds
  const Message wrong = world.hello(4, "c", "liver");
  CHECK(reason(wrong) == RefuseReason::bad_request);
  CHECK(std::get<Refuse>(wrong.body).message == "no room \"liver\" here; there is cube, organ");
  CHECK(world.rooms[0].station_count() == 1);
  CHECK(world.rooms[1].station_count() == 1);
}

TEST_CASE("What a station says goes to its own room, and to a stranger when the instance is none of ours") {
  Rooms world;
  Message organ = world.hello(1, "a", "organ");
  world.say(1, organ, Beat{});
  CHECK(world.rooms[0].station_count() == 0);
  CHECK(world.rooms[1].station_count() == 1);
  ++organ.instance;
  world.say(1, organ, Leave{});
  CHECK(world.rooms[1].station_count() == 1);
  --organ.instance;
  world.say(1, organ, Leave{});
  CHECK(world.rooms[1].station_count() == 0);
  Message lost{999, 7, 0, {}, Beat{}};
  CHECK(reason(world.ask(1, lost)) == RefuseReason::unknown_station);
}

TEST_CASE("A room that takes 120 ms over frames of 50 ms says so to stations with and without patches, and when it is over") {
  Bench bench;
  RawStation hand(bench, 1, "hand"), far(bench, 2, "far");
  hand.join();
  far.join();
  std::optional<FrameJob> out;
  Micros began{};
  int frames = 0;
  const auto run = [&](int ms, Micros compute) {
    for (int i = 0; i < ms; ++i) {
      bench.now += 1ms;
      hand.say_samples({hand.sample()});
      far.say_samples({far.sample()});
      bench.core.tick(bench.now);
      if (out && bench.now - began >= compute) {
        FrameResult result = bench.room.run(*out);
        for (auto& station : result.stations)
          if (station.id == far.as.station) station.patch.reset();
        bench.core.finish(std::move(result), bench.now);
        out.reset();
        ++frames;
      }
      if (!out) {
        out = bench.core.next_job(bench.now);
        began = bench.now;
      }
      bench.collect();
    }
  };
  const auto said = [&](PeerId peer) {
    double rate = 0;
    Micros behind{};
    int patches = 0;
    for (const auto& [to, message] : bench.sent) {
      if (to != peer) continue;
      patches += std::holds_alternative<PatchMessage>(message.body);
      if (const auto* beat = std::get_if<Beat>(&message.body)) {
        rate = beat->rate_hz;
        behind = beat->behind;
      }
    }
    bench.sent.clear();
    return std::tuple(rate, behind, patches);
  };
  run(500, 1ms);
  bench.sent.clear();
  run(1500, 1ms);
  CHECK(bench.core.pace().rate_hz == Approx(20));
  CHECK(std::get<0>(said(1)) == Approx(20).margin(1));
  const int before = frames;
  run(3000, 120ms);
  CHECK(frames - before == Approx(3000.0 / 120).margin(1));
  const auto sent = bench.sent;
  const auto [rate, behind, patches] = said(1);
  bench.sent = sent;
  CHECK(rate == Approx(1000.0 / 120).margin(1));
  CHECK(behind >= 119ms);
  CHECK(patches >= 18);
  CHECK(std::get<0>(said(2)) == Approx(1000.0 / 120).margin(1));
  run(2500, 1ms);
  CHECK(std::get<0>(said(1)) == Approx(20).margin(0.01 + 1));
  CHECK(bench.core.pace().rate_hz == Approx(20));
}
