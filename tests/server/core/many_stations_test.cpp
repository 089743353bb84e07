// A full room: each station with its own delay, clock, loss and scheme, and without effect on the others.
#include "raw_station.hpp"

#include "common/base/random.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

constexpr int kHands = 16, kViewers = 4;

/// A station whose samples arrive with age `lag`, or not at all.
struct Hand : RawStation {
  Micros lag;
  double loss;
  Random random;
  bool silent = false;

  Hand(Bench& b, int k)
      : RawStation(b, static_cast<PeerId>(k + 1), "hand " + std::to_string(k)),
        lag(Micros{3'000} * k),
        loss(k % 4 == 3 ? 0.3 : 0.0),
        random(static_cast<std::uint64_t>(k + 1)) {
    clock_offset = Micros{1'000'003} * (k * k - 60);
    drift = (k - 8) * 10e-6;
    hello.scheme = k % 3 == 0 ? Scheme::hold : Scheme::port;
  }
  void live_once() {
    if (!silent && random.uniform(0, 1) >= loss) say_samples({sample(lag)});
  }
};

struct Full {
  Bench bench;
  std::vector<std::unique_ptr<Hand>> hands;
  std::vector<std::unique_ptr<RawStation>> viewers;

  Full() {
    for (int k = 0; k < kHands; ++k) {
      hands.push_back(std::make_unique<Hand>(bench, k));
      hands.back()->join().lossless();
    }
    for (int k = 0; k < kViewers; ++k) {
      viewers.push_back(std::make_unique<RawStation>(bench, static_cast<PeerId>(100 + k), "viewer " + std::to_string(k)));
      viewers.back()->hello.role = Role::viewer;
      viewers.back()->join();
    }
  }
  void run(int ms) {
    for (int i = 0; i < ms; ++i) {
      bench.now += 1ms;
      for (auto& hand : hands) hand->live_once();
      if (i % 50 == 0)
        for (auto& viewer : viewers) viewer->say(Beat{});
      bench.tick();
    }
  }
  Micros behind() const { return bench.now - bench.room.jobs.back().target; }
};

}  // namespace

TEST_CASE("Sixteen hands with delays of their own and four viewers share a room: all hands get patches in their own clocks") {
  Full full;
  full.run(1000);
  full.bench.sent.clear();
  const auto frames = full.bench.room.jobs.size();
  full.run(1000);
  CHECK(full.bench.core.station_count() == kHands + kViewers);
  CHECK(full.bench.room.jobs.size() == frames + 20);
  CHECK(full.bench.room.jobs.back().stations.size() == kHands);
  CHECK(full.bench.room.jobs.back().shapes);
  std::vector<int> patches(kHands, 0);
  for (const auto& [to, message] : full.bench.sent) {
    const auto* patch = std::get_if<PatchMessage>(&message.body);
    if (to > kHands) {
      CHECK_FALSE(patch);
      continue;
    }
    if (!patch) continue;
    ++patches[to - 1];
    // The slowest is 45 ms late: no station waits that long for it, and a frame comes within a period.
    const Hand& hand = *full.hands[to - 1];
    const Micros age = hand.clock() - patch->patch.stamp;
    CHECK(age > -2ms);
    CHECK(age < 1100ms);
  }
  for (const int count : patches) CHECK(count == 20);
  CHECK(full.behind() >= kMostWait - 1ms);
  CHECK(full.behind() <= kMostWait + 6ms);
}

TEST_CASE("Quick hands wait a little for slower ones, and no longer for one that is much slower") {
  Full full;
  full.hands[5]->lag = 300ms;
  full.run(1500);
  CHECK(full.behind() <= kMostWait + 6ms);
  const auto& job = full.bench.room.jobs.back();
  REQUIRE(job.stations.size() == kHands);
  for (std::size_t k = 0; k < job.stations.size(); ++k) {
    const Hand& hand = *full.hands[k];
    REQUIRE_FALSE(job.stations[k].samples.empty());
    const bool known = job.stations[k].samples.back().t >= job.target;
    if (hand.loss == 0 && hand.lag < kMostWait) CHECK(known);
    if (hand.lag > kMostWait + 6ms) CHECK_FALSE(known);
  }
}

TEST_CASE("Hands that fall silent, lose datagrams or leave stall nobody, not for one frame") {
  Full full;
  full.run(1000);
  const auto& jobs = full.bench.room.jobs;
  const auto frames = jobs.size();
  full.hands[2]->silent = full.hands[9]->silent = true;
  full.hands[4]->say(Leave{});
  full.hands[4]->silent = true;
  full.run(2000);
  CHECK(jobs.size() >= frames + 39);
  for (std::size_t k = frames; k < jobs.size(); ++k) CHECK(jobs[k].target - jobs[k - 1].target <= 100ms);
  CHECK(jobs.back().stations.size() == kHands - 1);
  full.run(1500);
  CHECK(full.bench.core.station_count() == kHands + kViewers - 3);
  CHECK(full.bench.core.counts().timeouts == 2);
}

TEST_CASE("A hand that crashed comes back under its name from another address, while fifteen others go on") {
  Full full;
  full.run(500);
  Hand& crashed = *full.hands[7];
  crashed.silent = true;
  full.run(500);
  RawStation again(full.bench, 77, crashed.hello.station);
  CHECK(reason(again.ask()) == RefuseReason::name_taken);
  full.run(600);
  again.join();
  CHECK(full.bench.core.station_count() == kHands + kViewers);
  const auto frames = full.bench.room.jobs.size();
  for (int i = 0; i < 300; ++i) {
    again.say_samples({again.sample()});
    full.run(1);
  }
  CHECK(full.bench.room.jobs.size() >= frames + 5);
  CHECK(full.bench.room.jobs.back().stations.size() == kHands);
  CHECK(full.bench.core.stations().back().counts.patches > 0);
  // The crashed station's address now belongs to a stranger.
  full.bench.sent.clear();
  crashed.say(Beat{});
  CHECK(reason(full.bench.sent.back().second) == RefuseReason::unknown_station);
}
