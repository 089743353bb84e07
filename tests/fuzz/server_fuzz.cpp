// Arbitrary datagrams to a room's server, from any peer at any time: it does not crash, its datagrams can be read, nobody gets
// more bytes than it sent before it has proved that it receives, and the samples that drive the body are in the world and in
// order.
//
// Each input is a run. A byte selects the next event: time passes; one of several peers joins, sends a datagram of any kind in
// its own name, a damaged one, one in another's name, an earlier one again, or bytes of the script.
#include <array>
#include <cstdlib>

#include "client/core/haptic_tick.hpp"
#include "common/base/plain_text.hpp"
#include "common/base/random.hpp"
#include "common/session/clock_sync.hpp"
#include "tests/common/wire/seeds.hpp"
#include "tests/fuzz/script.hpp"
#include "tests/server/core/fake_room.hpp"

using namespace palpate;
using namespace std::chrono_literals;
using test::Script;

namespace {

constexpr std::size_t kPeers = 6, kKept = 64;

void require(bool condition) {
  if (!condition) std::abort();
}

/// A peer, the server's answers to it, and their traffic.
struct Peer {
  Message as;
  Micros offset{};  ///< offset of its clock
  ClockSync sync;
  bool proven = false;
  std::uint32_t newest = 0;  ///< newest datagram of the server
  std::size_t sent = 0, got = 0;
};

class Stage {
 public:
  Stage() {
    for (std::size_t k = 0; k < kPeers; ++k) peers_[k].offset = 10s * static_cast<int>(k);
    core_.on_event([](const RecordedEvent& event) { require(is_plain_text(event.name)); });
  }

  /// Starts with a hand that has received patches, and a viewer that has seen the body.
  void begin() {
    join_as(0, Hello{"s0", Role::haptic, Scheme::hold, 0, ""});
    join_as(1, Hello{"s1", Role::viewer, Scheme::hold, 0, ""});
    deliver(1, say(1, MeshRequest{0}));
    for (std::uint32_t k = 0; k < 30; ++k) {
      live(0, 10, 1);
      if (k % 5 == 0) deliver(1, say(1, ViewState{peers_[1].newest, ~0ull, 3, 2000}));
    }
    require(patches_ > 0 && shapes_ > 0 && core_.station_count() == 2);
  }

  void act(Script& script) {
    const std::uint64_t what = script.number(1);
    const std::size_t from = what >> 4 & 7u;
    if (from >= kPeers) return pass(Micros{static_cast<std::int64_t>(script.number(2)) * 50});
    switch (what & 15u) {
      case 0:
      case 1:
        return join(from, script);
      case 2:
      case 3:
      case 4:
        return live(from, script);
      case 5:
        return deliver(from, datagram_of(from, from, script));
      case 6:
        return deliver(from, damaged(datagram_of(from, from, script), script));
      case 7:
        return deliver(from, datagram_of(from, script.number(1) % kPeers, script));
      case 8:
        return replay(from, script);
      case 9:
        return raw(from, script);
      case 10:
        return change_room(script);
      case 11:
        return core_.expel(from, now_);
      default:
        return pass(Micros{1000} * static_cast<int>(what & 15u));
    }
  }

  void settle() {
    core_.tick(now_);
    if (const auto job = core_.next_job(now_)) {
      check(*job);
      core_.finish(room_.run(*job), now_);
      room_.jobs.clear();
    }
    collect();
  }

 private:
  using Datagram = std::vector<std::byte>;

  Micros clock(std::size_t k) const { return now_ + peers_[k].offset; }

  void pass(Micros time) {
    now_ += time;
    settle();
  }
  Datagram say(std::size_t k, Payload body) {
    Peer& peer = peers_[k];
    peer.as.body = std::move(body);
    peer.as.clock = peer.sync.stamp(clock(k));
    ++peer.as.seq;
    return seeds::bytes_of(peer.as);
  }
  void join(std::size_t k, Script& script) {
    const std::uint64_t how = script.number(1);
    Hello hello{"s" + std::to_string(how & 7u), (how & 8u) != 0 ? Role::viewer : Role::haptic, Scheme::hold, 0, ""};
    if ((how & 16u) != 0) hello.shadow_of = "s" + std::to_string(how >> 5);
    hello.alike = (how & 32u) != 0;
    if ((how & 64u) != 0) hello.guides = "s" + std::to_string(how & 3u);
    join_as(k, hello);
  }
  void join_as(std::size_t k, const Hello& hello) {
    peers_[k].as = {};
    deliver(k, say(k, hello));
    if (peers_[k].as.station != 0) deliver(k, say(k, Beat{.link = {1000, 0, 0, {}}}));
  }
  /// Sends some of its samples, as a device would give them.
  void live(std::size_t k, Script& script) {
    const std::uint64_t how = script.number(1);
    live(k, how % 16 + 1, static_cast<std::uint32_t>(how >> 4));
  }
  void live(std::size_t k, std::uint64_t ticks, std::uint32_t playing) {
    Samples samples;
    for (std::uint64_t n = ticks; n > 0; --n) {
      now_ += 1ms;
      samples.samples.push_back({clock(k), Vec3(0, 0, 0.001 * static_cast<double>(n))});
    }
    samples.playing = playing;
    deliver(k, say(k, samples));
    settle();
  }
  /// Datagram of any kind, in its own name or another's.
  Datagram datagram_of(std::size_t from, std::size_t name, Script& script) {
    static const auto kinds = seeds::every_kind();
    Message message = kinds[script.number(1) % kinds.size()];
    message.instance = peers_[name].as.instance;
    message.station = peers_[name].as.station;
    message.seq = ++peers_[name].as.seq;
    message.clock = peers_[name].sync.stamp(clock(from));
    // A peer that has another's secret may have received it at that one's address.
    if (from != name) peers_[from].proven = peers_[from].proven || peers_[name].as.station != 0;
    return seeds::bytes_of(message);
  }
  Datagram damaged(Datagram datagram, Script& script) {
    script.damage(std::span(datagram));
    return datagram;
  }
  void replay(std::size_t from, Script& script) {
    if (said_.empty()) return;
    peers_[from].proven = true;
    deliver(from, said_[script.number(1) % said_.size()]);
  }
  void raw(std::size_t from, Script& script) {
    const auto bytes = std::as_bytes(script.bytes(script.number(2) % 1400));
    deliver(from, {bytes.begin(), bytes.end()});
  }
  void change_room(Script& script) {
    const std::uint64_t how = script.number(1);
    room_.in_reach = (how & 1u) == 0;
    room_.fail = (how & 2u) != 0;
    room_.asleep = (how & 4u) != 0;
    room_.renews = (how & 8u) != 0;
    room_.valid_for = (how & 16u) != 0 ? Micros{1000} : Micros{1'000'000};
    static const NonlinearTerms terms = seeds::spring_terms(6, false, 60, 40);
    room_.terms = (how & 32u) != 0 ? terms : NonlinearTerms{};
    room_.step_took = Micros{1000} * static_cast<int>(how >> 4);
  }

  void deliver(std::size_t from, Datagram datagram) {
    Peer& peer = peers_[from];
    peer.sent += datagram.size();
    peer.proven = peer.proven || peer.as.station != 0;
    core_.take(datagram, from, now_);
    if (said_.size() < kKept) said_.push_back(std::move(datagram));
    require(core_.station_count() <= kMaxStations);
    collect();
  }

  void collect() {
    std::array<std::byte, kMaxDatagramBytes> bytes;
    PeerId to = 0;
    for (int n = 0; const std::size_t size = core_.emit(bytes, to, now_); ++n) {
      require(n < 100'000 && to < kPeers);
      Message message;
      require(decode(std::span(bytes).first(size), message) == WireFault::none);
      hear(peers_[to], message, size, clock(to));
    }
  }
  void hear(Peer& peer, const Message& message, std::size_t size, Micros now) {
    peer.got += size;
    require(peer.proven || peer.got <= peer.sent);
    if (std::holds_alternative<Welcome>(message.body)) {
      peer.as.instance = message.instance;
      peer.as.station = message.station;
    }
    patches_ += std::holds_alternative<PatchMessage>(message.body);
    shapes_ += std::holds_alternative<ShapePiece>(message.body);
    peer.newest = message.seq;
    peer.sync.take(message.clock, now);
  }

  void check(const FrameJob& job) {
    require(job.target >= job.begin && job.target <= now_ + 1s);
    for (const StationJob& station : job.stations)
      for (std::size_t k = 0; k < station.samples.size(); ++k) {
        require(in_world(station.samples[k].position));
        require(k == 0 || station.samples[k].t > station.samples[k - 1].t);
      }
  }

  ServerCore core_{test_facts(), {.draw = repeatable(42), .rate_hz = 20}};
  FakeRoom room_;
  Micros now_{5'000'000};
  std::array<Peer, kPeers> peers_;
  std::vector<Datagram> said_;
  int patches_ = 0, shapes_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Stage stage;
  Script script(data, size);
  stage.settle();
  if (script.number(1) % 4 != 0) stage.begin();
  while (!script.ended()) stage.act(script);
  return 0;
}
