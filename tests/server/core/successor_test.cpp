// A newer session with a station's own key, after a crash and restart, gets its name and seat.
#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

/// Peers 10, 11, 12 are sessions of one key, later ones newer; all others have their own keys.
struct Keyed : Bench {
  explicit Keyed(bool keys = true) {
    if (keys) core.know_keys([](PeerId peer) { return std::to_string(peer / 10); });
  }
  /// Asks every 250 ms, like a client without an answer, and then once a second. Returns the time until it joined; empty within 4
  /// s.
  std::optional<Micros> asks_until_in(RawStation& station, const std::function<void()>& meanwhile = {}) {
    const Micros from = now;
    for (Micros next = now; now < from + 4s; wait_with(1ms, meanwhile)) {
      if (now < next) continue;
      const auto answer = asks(station);
      next += answer ? 1s : 250ms;
      if (!answer || !std::holds_alternative<Welcome>(answer->body)) continue;
      station.as.instance = answer->instance;
      station.as.station = answer->station;
      station.say(Beat{});
      return now - from;
    }
    return std::nullopt;
  }
  std::optional<Message> asks(RawStation& station) {
    station.as.instance = station.as.station = 0;
    sent.clear();
    station.say(station.hello);
    for (const auto& [to, message] : sent)
      if (to == station.peer) return message;
    return std::nullopt;
  }
  void wait_with(Micros time, const std::function<void()>& meanwhile) {
    wait(time);
    if (meanwhile) meanwhile();
  }
  bool has(const RawStation& station) {
    return core.knows({station.as.instance, station.as.station, 0, {}, Beat{}}, station.peer, now);
  }
};

/// Sends and receives everything every 20 ms.
std::function<void()> lives(Keyed& bench, RawStation& station) {
  return [&bench, &station, next = bench.now]() mutable {
    if (bench.now < next) return;
    next += 20ms;
    station.hear_all();
    station.say(Beat{});
  };
}

}  // namespace

TEST_CASE("A station that crashed is in again as soon as its own key asks, without keys when it was silent for a second") {
  for (const bool keys : {true, false}) {
    Keyed bench(keys);
    RawStation dead(bench, 10, "hand"), again(bench, 11, "hand");
    dead.join().live();
    const auto in = bench.asks_until_in(again);
    REQUIRE(in);
    CHECK(*in == (keys ? Micros{250ms} : Micros{2s}));  // refused at once and a second later, admitted at the third attempt
    CHECK(bench.core.station_count() == 1);
    CHECK(bench.has(again));
    CHECK(bench.core.counts().replaced == 1);
  }
}

TEST_CASE("A station of another key, or an older session of the same, waits until the name is free") {
  for (const PeerId peer : {20, 9, 10}) {
    Keyed bench;
    RawStation dead(bench, 11, "hand"), other(bench, peer, "hand");
    dead.join().live();
    const auto in = bench.asks_until_in(other);
    REQUIRE(in);
    CHECK(*in > kSilentAfter);
  }
}

TEST_CASE("What a dead station said and somebody brings late does not keep its successor out") {
  Keyed bench;
  RawStation dead(bench, 10, "hand"), again(bench, 11, "hand"), other(bench, 20, "other");
  dead.join().live();
  Message held = dead.as;
  held.body = Beat{};
  held.clock = dead.sync.stamp(dead.clock());
  const auto brings = [&] {
    ++held.seq;
    bench.deliver(10, held);
  };
  const auto in = bench.asks_until_in(again, brings);
  REQUIRE(in);
  CHECK(*in >= kSuccessorProof);
  CHECK(*in <= kSuccessorProof + Micros{250ms});
  CHECK_FALSE(bench.has(dead));
}

TEST_CASE("Of two that live with one key and name neither takes the other's seat") {
  Keyed bench;
  RawStation first(bench, 10, "hand"), second(bench, 11, "hand");
  first.join().live();
  CHECK_FALSE(bench.asks_until_in(second, lives(bench, first)));
  CHECK(bench.has(first));
  CHECK(bench.core.counts().replaced == 0);
  CHECK(bench.core.counts().refused[static_cast<std::size_t>(RefuseReason::name_taken)] >= 3);
  // After enough silence it is removed, and the newer live one is safe from it.
  REQUIRE(bench.asks_until_in(second));
  CHECK_FALSE(bench.asks_until_in(first, lives(bench, second)));
  CHECK(bench.has(second));
  CHECK(bench.core.counts().replaced == 1);
}

TEST_CASE("Where another name will do a successor gets its own again, and one beside a station that lives another") {
  for (const bool dies : {true, false}) {
    Keyed bench;
    RawStation first(bench, 10, "hand"), second(bench, 11, "hand");
    second.hello.alike = true;
    first.join().live();
    REQUIRE(bench.asks_until_in(second, dies ? std::function<void()>() : lives(bench, first)));
    CHECK(bench.core.station_count() == (dies ? 1u : 2u));
    CHECK(bench.has(first) != dies);
  }
}

TEST_CASE("A viewer that lives is not taken for dead because it says something four times a second") {
  Keyed bench;
  RawStation first(bench, 10, "screen"), second(bench, 11, "screen"), third(bench, 12, "screen");
  first.hello.role = second.hello.role = third.hello.role = Role::viewer;
  first.join();
  const auto beats = [&bench, &first, next = bench.now]() mutable {
    if (bench.now < next) return;
    next += 250ms;
    first.hear_all();
    first.say(Beat{});
  };
  CHECK_FALSE(bench.asks_until_in(second, beats));
  CHECK(bench.has(first));
  const auto in = bench.asks_until_in(third);
  REQUIRE(in);
  CHECK(*in == kSuccessorProof);
}
