// An empty room whose body sleeps does nothing at all, and later continues as if it had never stopped.
#include "raw_station.hpp"
#include "server/core/server_rooms.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

/// Ticks the server until `end`, each time at its own deadline, as a real one wakes for nothing else but datagrams; returns their
/// number.
int wake_ups(Bench& bench, Micros end) {
  int ticks = 0;
  for (; bench.core.deadline() <= end; ++ticks) {
    bench.now = bench.core.deadline();
    bench.tick();
  }
  bench.now = end;
  return ticks;
}

}  // namespace

TEST_CASE("A server whose body sleeps and whom nobody visits wakes up for one frame, then never") {
  Bench bench;
  CHECK(wake_ups(bench, bench.now + 10s) == 200);
  bench.room.asleep = true;
  CHECK(wake_ups(bench, bench.now + 10s) == 1);
  const auto frames = bench.core.counts().frames;
  CHECK(wake_ups(bench, bench.now + 24h) == 0);
  CHECK(bench.core.deadline() == Micros::max());
  CHECK(bench.core.counts().frames == frames);
  // The first visitor wakes it, without a tick in between.
  RawStation(bench, 1, "hand").join();
  const Micros due = bench.core.deadline();
  CHECK(due - bench.now <= 50ms);
  bench.now = due;
  bench.tick();
  CHECK(bench.core.counts().frames == frames + 1);
  CHECK(bench.room.jobs.back().begin == due - 50ms);
  CHECK(bench.room.jobs.back().target == due);
}

TEST_CASE("A room that was idle gives a visitor the frames and stamps of one that never did") {
  Bench idle, awake;
  idle.room.asleep = true;
  std::vector<Patch> patches[2];
  for (Bench* bench : {&idle, &awake}) {
    bench->wait(10s);
    bench->now += 17ms;
    bench->tick();
    bench->room.asleep = false;
    RawStation hand(*bench, 1, "hand");
    hand.join();
    bench->room.jobs.clear();
    for (int k = 0; k < 20; ++k) {
      hand.live(50ms);
      if (const auto message = bench->last<PatchMessage>(1))
        patches[bench == &awake].push_back(std::get<PatchMessage>(message->body).patch);
      hand.hear_all();
    }
  }
  CHECK(idle.core.counts().frames < awake.core.counts().frames - 190);
  REQUIRE(patches[0].size() > 10);
  REQUIRE(patches[0].size() == patches[1].size());
  for (std::size_t k = 0; k < patches[0].size(); ++k) {
    CHECK(patches[0][k].stamp == patches[1][k].stamp);
    CHECK(patches[0][k].seq == patches[1][k].seq);
  }
  REQUIRE(idle.room.jobs.size() == awake.room.jobs.size());
  for (std::size_t k = 0; k < idle.room.jobs.size(); ++k) {
    CHECK(idle.room.jobs[k].begin == awake.room.jobs[k].begin);
    CHECK(idle.room.jobs[k].target == awake.room.jobs[k].target);
  }
}

TEST_CASE(
    "A visitor keeps the frames of a sleeping body coming, counted as such, and with the last to go the room is idle again") {
  Bench bench;
  bench.room.asleep = true;
  bench.room.in_reach = false;
  bench.wait(1s);
  RawStation hand(bench, 1, "hand");
  hand.join();
  hand.live(1s);
  const ServerCounts counts = bench.core.counts();
  CHECK(counts.frames >= 20);
  CHECK(counts.frames_asleep == counts.frames);
  CHECK(counts.steps == 0);
  CHECK(bench.last<Beat>(1));
  bench.core.take(std::array<std::byte, 3>{}, 9, bench.now);  // noise wakes no room
  bench.now += kGoneAfter;
  bench.tick();
  CHECK(bench.core.station_count() == 0);
  CHECK(bench.core.deadline() == Micros::max());
}

TEST_CASE("A server wakes for the room that has somebody, and for no other") {
  std::vector<ServerRooms::RoomSpec> specs;
  for (int k = 0; k < 16; ++k) specs.push_back({"room " + std::to_string(k), test_facts()});
  ServerRooms rooms(std::move(specs), repeatable(42), 20);
  FakeRoom body;
  body.asleep = true;
  const auto tick = [&](Micros now) {
    rooms.tick(now);
    for (std::size_t k = 0; k < rooms.size(); ++k)
      if (const auto job = rooms[k].next_job(now)) rooms[k].finish(body.run(*job), now);
  };
  tick(1s);
  tick(rooms.deadline());
  CHECK(rooms.deadline() == Micros::max());
  Message hello;
  hello.body = Hello{"hand", Role::haptic, Scheme::port, 0, "", "room 7"};
  std::array<std::byte, kMaxDatagramBytes> bytes;
  rooms.take(std::span(bytes).first(encode(hello, bytes)), 1, 2s);
  CHECK(rooms.deadline() == Micros::max());  // an unproven handshake wakes nothing
  PeerId to = 0;
  REQUIRE(decode(std::span(bytes).first(rooms.emit(bytes, to, 2s)), hello) == WireFault::none);
  hello.body = Beat{};
  rooms.take(std::span(bytes).first(encode(hello, bytes)), 1, 2s);
  body.jobs.clear();
  for (Micros now = 2s; now < 4s; now = rooms.deadline()) tick(now);
  CHECK(body.jobs.size() == 40);
  CHECK(rooms[7].counts().frames == 41);
  CHECK(rooms[6].counts().frames == 1);
}
