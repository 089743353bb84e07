// Strangers, forgers and greedy stations have no effect on a room that its stations would notice.
#include <map>

#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

constexpr PeerId kVictim = 77;

/// Bytes sent to a peer since the last look.
std::size_t bytes_to(const Bench& bench, PeerId peer) {
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < bench.sent.size(); ++k)
    if (bench.sent[k].first == peer) bytes += bench.sizes[k];
  return bytes;
}

/// A room whose frames take as long as their patches.
struct CostlyRoom : Bench {
  static constexpr Micros kPatch{16'000}, kStep{5'000};
  std::optional<FrameResult> computing;
  Micros done{};
  std::map<PeerId, int> patches;

  void tick_costly() {
    if (computing && now >= done) core.finish(*std::exchange(computing, std::nullopt), now);
    core.tick(now);
    if (const auto job = core.next_job(now)) {
      FrameResult result = room.run(*job);
      std::int64_t built = 0;
      for (const StationFrame& frame : result.stations) built += frame.patch.has_value();
      result.step_took = kStep;
      result.patches_took = built * kPatch;
      done = now + result.step_took + result.patches_took;
      computing = std::move(result);
    }
    collect();
    std::map<PeerId, std::uint32_t> seqs;
    for (const auto& [to, message] : sent)
      if (const auto* patch = std::get_if<PatchMessage>(&message.body); patch && seqs[to] != patch->patch.seq) {
        seqs[to] = patch->patch.seq;
        ++patches[to];
      }
    sent.clear();
    sizes.clear();
  }
  /// Runs all stations, pushing or viewing, for this time.
  void live(std::vector<RawStation>& all, Micros time) {
    for (const Micros end = now + time; now < end;) {
      now += 1ms;
      for (RawStation& station : all)
        if (now.count() / 1000 % 5 == 0) {
          if (station.hello.shadow_of.empty())
            station.say_samples({station.sample()});
          else
            station.say(Beat{});
        }
      tick_costly();
    }
  }
};

}  // namespace

TEST_CASE("nobody is proven at an address with what others are told: neither by the next number nor by a refusal's instance") {
  Bench bench;
  bench.room.asleep = false;
  RawStation thief(bench, 1, "thief");
  const Message own = thief.ask();
  bench.deliver(1, Message{12345, 999, 1, {}, Beat{}});
  const Message refusal = bench.sent.back().second;
  CHECK(refusal.instance == 12345);  // the sender's own number, and nothing of ours
  Message hello;
  hello.body = Hello{"victim", Role::viewer, Scheme::port, 0, ""};
  bench.sent.clear();
  bench.sizes.clear();
  bench.deliver(kVictim, hello);
  const std::size_t told = bytes_to(bench, kVictim);
  std::size_t said = kHelloBytes;
  CHECK(told <= said);
  for (const StationId id : {own.station, own.station + 1, own.station + 2})
    for (const std::uint64_t instance : {own.instance, own.instance + 1, refusal.instance, std::uint64_t{0}}) {
      bench.deliver(kVictim, Message{instance, id, 1, {}, MeshRequest{0}});
      said += 84;
    }
  bench.wait(2s);
  CHECK(bytes_to(bench, kVictim) <= said);
  for (const auto& [to, message] : bench.sent) {
    CHECK_FALSE(std::holds_alternative<MeshPiece>(message.body));
    CHECK_FALSE(std::holds_alternative<ShapePiece>(message.body));
  }
  CHECK(bench.core.station_count() == 0);
}

TEST_CASE("a thousand Hellos that nobody stands behind take no seat, no node, no name and no frame") {
  Bench bench(ContactKind::attach);
  bench.room.asleep = true;
  bench.wait(200ms);
  REQUIRE(bench.core.deadline() == Micros::max());
  for (PeerId peer = 100; peer < 1100; ++peer) RawStation(bench, peer, peer % 2 == 0 ? "hand" : "s" + std::to_string(peer)).ask();
  CHECK(bench.core.deadline() == Micros::max());
  CHECK(bench.core.station_count() == 0);
  RawStation hand(bench, 1, "hand");
  CHECK(std::get<Welcome>(hand.ask().body).station == "hand");
  hand.join();
  CHECK(bench.core.station_count() == 1);
  CHECK(bench.core.deadline() < Micros::max());
}

TEST_CASE("of two who were both welcome to the same node or name the one who is there first gets it, and the other hears why") {
  Bench bench(ContactKind::attach);
  RawStation first(bench, 1, "first"), second(bench, 2, "second");
  const Message welcome = second.ask();
  REQUIRE(std::holds_alternative<Welcome>(welcome.body));
  first.join();
  second.as.instance = welcome.instance;
  second.as.station = welcome.station;
  second.say(Beat{});
  CHECK(reason(bench.sent.back().second) == RefuseReason::unknown_station);
  CHECK(reason(second.ask()) == RefuseReason::node_taken);
  CHECK(bench.core.station_count() == 1);
}

TEST_CASE("forged Hellos, Leaves and samples from the very address of a station change nothing for it") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().lossless().live();
  const auto before = bench.core.counts();
  bench.sent.clear();
  int patches = 0;
  for (int k = 0; k < 1000; ++k) {
    Message forged;
    forged.clock = {hand.clock() + 245ms, {}, {}};
    forged.body = Hello{"hand", Role::haptic, Scheme::hold, 0, ""};
    bench.deliver(1, forged);
    forged = {hand.as.instance + 1, hand.as.station, 1u << 20, {hand.clock() + 245ms, {}, {}}, Leave{}};
    bench.deliver(1, forged);
    forged.body = Samples{{{hand.clock() + 245ms, Vec3(1, 1, 1)}}};
    bench.deliver(1, forged);
    hand.live(1ms);
    for (const auto& [to, message] : bench.sent) patches += std::holds_alternative<PatchMessage>(message.body);
    bench.sent.clear();
  }
  CHECK(bench.core.counts().joins == before.joins);
  CHECK(bench.core.counts().leaves == 0);
  CHECK(patches == Approx(20).margin(1));
  CHECK(bench.now - bench.room.jobs.back().target <= 51ms);
}

TEST_CASE(
    "a station that says its clock is ten thousand years ahead, or that its tool is where it will be, is itself again soon") {
  const Micros ahead = GENERATE(Micros{10'000'000'000'000'000}, Micros{10'000'000}, Micros{245'000});
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().lossless().live();
  Message poison = hand.as;
  poison.clock = hand.sync.stamp(hand.clock());
  poison.clock.sent = std::min(poison.clock.sent + ahead, Micros{10'000'000'000'000'000});  // largest value on the wire
  poison.body = Samples{{{hand.clock() + std::min(ahead, Micros{10'000'000}), Vec3(1, 1, 1)}}};
  bench.deliver(1, poison);
  for (int k = 0; k < 30; ++k) {
    hand.live(10ms);
    hand.hear_all();
    bench.sent.clear();
  }
  CAPTURE(ahead.count());
  int patches = 0;
  for (int k = 0; k < 100; ++k) {
    hand.live(10ms);
    hand.hear_all();
    for (const auto& [to, message] : bench.sent)
      if (const auto* patch = std::get_if<PatchMessage>(&message.body)) {
        ++patches;
        CHECK(std::abs((patch->patch.stamp - hand.clock()).count()) < 60'000);
      }
    bench.sent.clear();
  }
  CHECK(patches == 20);
  CHECK(std::abs((bench.core.stations().at(0).offset).count()) < 1'000);
}

TEST_CASE("a viewer gets no more than the server's limit, whatever it asks for") {
  Bench bench;
  RawStation hand(bench, 1, "hand"), eye(bench, 2, "eye");
  hand.join();
  eye.hello.role = Role::viewer;
  eye.join();
  ShapeViewer viewer;
  const ShapeStream shapes(bench.core.facts(), 20);
  ViewState greedy;
  greedy.kbit_s = 65'535;
  shapes.heard(viewer, greedy);
  viewer.tokens_bytes = 0;
  shapes.begin(viewer, 1s);
  CHECK(viewer.tokens_bytes == Approx(kShapeKbitSMost * 125 / 20));
  viewer.tokens_bytes = 0;
  shapes.begin(viewer, 1s, 16);
  CHECK(viewer.tokens_bytes == Approx(kShapeKbitSRoom / 16 * 125 / 20));
}

TEST_CASE("a room lets in sixteen shadows and sixteen viewers, and hands beside them") {
  Bench bench;
  RawStation(bench, 1, "hand").join();
  for (const bool views : {false, true})
    for (PeerId k = 0; k < 17; ++k) {
      RawStation other(bench, 100 + 100 * views + k, (views ? "eye " : "shadow ") + std::to_string(k));
      if (views) other.hello.role = Role::viewer;
      if (!views) other.hello.shadow_of = "hand";
      if (k < 16)
        other.join();
      else
        CHECK(reason(other.ask()) == RefuseReason::room_full);
    }
  RawStation(bench, 2, "second hand").join();
  CHECK(bench.core.station_count() == 34);
}

TEST_CASE("62 hands that ask for the costliest scheme, or 8 shadows, leave the first hand its patches") {
  const bool shadows = GENERATE(false, true);
  CostlyRoom bench;
  bench.room.built = Scheme::hyper;
  std::vector<RawStation> all;
  all.reserve(63);
  all.emplace_back(bench, 1, "first");
  all.back().hello.scheme = Scheme::hyper;
  all.back().join().lossless();
  bench.live(all, 2s);
  bench.patches.clear();
  bench.live(all, 5s);
  const int alone = bench.patches[1];
  REQUIRE(alone >= 99);
  for (int k = 0; k < (shadows ? 8 : 62); ++k) {
    all.emplace_back(bench, static_cast<PeerId>(2 + k), "other " + std::to_string(k));
    all.back().hello.scheme = Scheme::hyper;
    if (shadows) all.back().hello.shadow_of = "first";
    all.back().join().lossless();
  }
  bench.live(all, 3s);
  bench.patches.clear();
  bench.live(all, 10s);
  CAPTURE(shadows);
  CHECK(bench.patches[1] >= 0.95 * 2 * alone);
  int others = 0;
  for (const auto& [peer, count] : bench.patches) {
    CHECK(count > 0);
    others += peer != 1 ? count : 0;
  }
  CHECK(bench.patches.size() == all.size());
  CHECK(others >= 190);  // one per frame, as far as the time allows
}

TEST_CASE("a room whose body failed tells its stations and whoever comes, and begins no frame") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  bench.sent.clear();
  bench.core.end("the body of this room failed", bench.now);
  bench.collect();
  REQUIRE(bench.sent.size() == 1);
  CHECK(reason(bench.sent[0].second) == RefuseReason::shutting_down);
  CHECK(bench.sent[0].second.instance == hand.as.instance);
  CHECK(std::get<Refuse>(bench.sent[0].second.body).message == "the body of this room failed");
  const Message answer = hand.ask();
  CHECK(reason(answer) == RefuseReason::bad_request);
  CHECK(std::get<Refuse>(answer.body).message == "the body of this room failed");
  const auto frames = bench.room.jobs.size();
  bench.wait(1s);
  CHECK(bench.room.jobs.size() == frames);
  CHECK(bench.core.deadline() == Micros::max());
}
