// A station made of bare messages, valid or not as the test requires.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "fake_room.hpp"

namespace palpate {

/// Server with a fake room, stepped in milliseconds; datagrams arrive at once unless a test holds them back.
struct Bench {
  ServerCore core;
  FakeRoom room;
  Micros now{5'000'000};
  std::vector<std::pair<PeerId, Message>> sent;  ///< by the server since the last look
  std::vector<std::size_t> sizes;

  explicit Bench(ContactKind contact = ContactKind::touch, double rate_hz = 20, double deadband = 0)
      : core(test_facts(contact), {.draw = repeatable(42), .rate_hz = rate_hz, .deadband = deadband}) {
    core.tick(now);
  }

  void deliver(PeerId from, const Message& message) {
    std::array<std::byte, kMaxDatagramBytes> bytes;
    const auto size = encode(message, bytes);
    REQUIRE(size > 0);
    core.take(std::span(bytes).first(size), from, now);
    collect();
  }
  void collect() {
    std::array<std::byte, kMaxDatagramBytes> bytes;
    PeerId to = 0;
    while (const auto size = core.emit(bytes, to, now)) {
      Message message;
      REQUIRE(decode(std::span(bytes).first(size), message) == WireFault::none);
      sent.emplace_back(to, message);
      sizes.push_back(size);
    }
  }
  void tick() {
    core.tick(now);
    if (const auto job = core.next_job(now)) core.finish(room.run(*job), now);
    collect();
  }
  void wait(Micros time) {
    for (const auto end = now + time; now < end;) {
      now += Micros{1'000};
      tick();
    }
  }
  /// Returns the newest message of a kind to a peer, and removes it with all older ones.
  template <class Kind>
  std::optional<Message> last(PeerId peer) {
    for (auto it = sent.rbegin(); it != sent.rend(); ++it)
      if (it->first == peer && std::holds_alternative<Kind>(it->second.body)) {
        const auto message = it->second;
        sent.clear();
        return message;
      }
    return std::nullopt;
  }
};

struct RawStation {
  Bench& bench;
  PeerId peer;
  Hello hello;
  Micros clock_offset{};  ///< its clock minus the server's
  double drift = 0;
  Message as;  ///< instance, id and seq of its messages
  ClockSync sync;

  RawStation(Bench& b, PeerId p, const std::string& name) : bench(b), peer(p) { hello.station = name; }

  Micros clock() const { return bench.now + clock_offset + Micros{std::llround(drift * static_cast<double>(bench.now.count()))}; }
  void say(Payload body) {
    as.body = std::move(body);
    as.clock = sync.stamp(clock());
    bench.deliver(peer, as);
    ++as.seq;
  }
  /// Sends Hello and returns the server's answer.
  Message ask() {
    as.instance = 0;
    as.station = 0;
    bench.sent.clear();
    say(hello);
    REQUIRE_FALSE(bench.sent.empty());
    const auto answer = bench.sent.back().second;
    bench.sent.clear();
    return answer;
  }
  /// Joins and locks the clocks.
  RawStation& join() {
    const auto answer = ask();
    REQUIRE(std::holds_alternative<Welcome>(answer.body));
    as.instance = answer.instance;
    as.station = answer.station;
    hear(answer);
    say(Beat{});
    return *this;
  }
  /// Reports no loss over enough datagrams: from now on each patch is sent once.
  RawStation& lossless() {
    say(Beat{.link = {1000, 0, 0, {}}});
    return *this;
  }
  void hear(const Message& message) { sync.take(message.clock, clock()); }
  void hear_all() {
    for (const auto& [to, message] : bench.sent)
      if (to == peer) hear(message);
  }
  ToolSample sample(Micros age = {}) const { return {clock() - age, Vec3(0, 0, 0.01 * seconds(clock() - age))}; }
  void say_samples(std::vector<ToolSample> samples) { say(Samples{std::move(samples)}); }
  /// Runs for half a second: a sample per millisecond, one datagram each.
  void live(Micros time = Micros{500'000}) {
    for (const auto end = bench.now + time; bench.now < end;) {
      bench.now += Micros{1'000};
      say_samples({sample()});
      bench.tick();
    }
  }
};

inline RefuseReason reason(const Message& answer) {
  REQUIRE(std::holds_alternative<Refuse>(answer.body));
  const auto& refuse = std::get<Refuse>(answer.body);
  CHECK((refuse.reason == RefuseReason::unknown_station || !refuse.message.empty()));  // a text may not fit there
  return refuse.reason;
}

}  // namespace palpate
