// The trust channel in the simulated world: it changes no felt force, and neither does an attacker without a key for the room.
#include <algorithm>
#include <catch2/catch.hpp>

#include "bench/world/attacked.hpp"
#include "client/device/replay_device.hpp"

using namespace palpate;

namespace {

Scenario trusted_scenario(std::uint64_t seed, bool faults, bool losses, bool keys = false) {
  DrawOptions draw;
  draw.seed = seed;
  draw.duration_s = 1.2;
  draw.faults = faults;
  draw.losses = losses;
  draw.keys = keys;
  return draw_scenario(draw);
}

/// Returns true if a server or station restarts: a restarted server has other keys, and datagrams in flight to it are useless; a
/// restarted station is its own successor.
bool restarts(const Scenario& scenario) {
  return std::any_of(scenario.faults.begin(), scenario.faults.end(), [](const Fault& fault) {
    return fault.kind == FaultKind::server_restart || fault.kind == FaultKind::crash || fault.kind == FaultKind::leave;
  });
}

std::string difference(const WorldReport& a, const WorldReport& b) {
  const auto tick = first_difference(a, b);
  return tick ? "from tick " + std::to_string(*tick) + " of " + std::to_string(a.trail.size()) : "none";
}

/// A hand with a key that holds a node 3 mm off.
struct KeyedHand {
  Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/cube6.json");
  World world;
  WorldStation* station = nullptr;
  Micros felt{};   ///< when a force was last felt
  Micros stamp{};  ///< stamp of the patch in use, in its own clock

  explicit KeyedHand(Micros way) : world(scene, keyed()) {
    ClientOptions options;
    options.hello.station = "hand";
    LinkSpec link;
    link.latency = way;
    const Vec3 place = home_of(scene) + Vec3(0.003, 0, 0);
    station = &world.add_station(options, std::make_unique<ReplayDevice>(Motion::rest(place, 60)), link);
    station->on_tick = [this](Micros now, const Vec3&, const TickOutput& out) {
      if (out.force.norm() > 0) felt = now;
      if (out.has_patch) stamp = out.patch_stamp;
    };
  }
  static WorldOptions keyed() {
    WorldOptions options;
    options.keys.emplace();
    return options;
  }
};

}  // namespace

TEST_CASE("A key that is taken out has no station at once and no force within a second, also where the word of it is lost") {
  for (const int way_ms : {0, 30, 150})
    for (const bool lost : {false, true}) {
      KeyedHand hand(Micros{1000 * way_ms});
      constexpr Micros kOut{6'000'000}, kSecond{1'000'000};
      hand.world.run_until(kOut);
      INFO(way_ms << " ms each way" << (lost ? ", cut" : ""));
      REQUIRE(hand.world.server().station_count() == 1);
      REQUIRE(hand.felt >= kOut - Micros{2'000});
      hand.station->cut(false, lost);
      hand.world.trust().take_out(0);
      hand.world.run_until(kOut + Micros{2'000});
      CHECK(hand.world.server().station_count() == 0);
      hand.world.run_until(kOut + Micros{4'000'000});
      CHECK(hand.felt < kOut + kSecond);
      CHECK(hand.world.server().station_count() == 0);
    }
}

TEST_CASE("A hand whose address changes on the way, all of a sudden, feels on with the session that it has, whatever the way") {
  for (const int way_ms : {0, 30, 150}) {
    KeyedHand hand(Micros{1000 * way_ms});
    constexpr Micros kMoved{6'000'000};
    // A datagram from there, the question, the answer; a later sample and a patch that contains it; two frames.
    const Micros by = kMoved + Micros{1000 * 5 * way_ms} + Micros{150'000};
    hand.world.at(kMoved, [&] { hand.world.rebind(0); });
    hand.world.run_until(by);
    INFO(way_ms << " ms each way");
    CHECK(hand.stamp > hand.station->clock(kMoved));
    CHECK(hand.felt >= by - Micros{2'000});
    CHECK(hand.world.server().station_count() == 1);
    CHECK(hand.world.trust().client(0, hand.station->clock(by)).counts().handshakes == 1);
    CHECK(hand.world.trust().server().channel().counts().moves == 1);
  }
}

TEST_CASE("A hand that crashes and is started again has its own name and force within a second, whatever the way") {
  for (const int way_ms : {0, 30, 150})
    for (const int away_ms : {1, 100, 2000}) {
      KeyedHand hand(Micros{1000 * way_ms});
      constexpr Micros kCrash{6'000'000};
      const Micros again = kCrash + Micros{1000 * away_ms};
      // Two round trips for keys, one each for Hello, the first sample and the patch; the wait of a successor and its next Hello.
      const Micros by = again + Micros{1000 * 10 * way_ms} + kSuccessorAfter + kHelloEvery + Micros{250'000};
      hand.world.at(kCrash, [&] { hand.station->crash(); });
      hand.world.at(again, [&] { hand.station->join_again(hand.world.now()); });
      hand.world.run_until(kCrash - Micros{1});
      REQUIRE(hand.felt >= kCrash - Micros{2'000});
      hand.felt = {};
      hand.world.run_until(by);
      INFO(way_ms << " ms each way, away for " << away_ms << " ms");
      CHECK(hand.felt >= by - Micros{2'000});
      CHECK(hand.station->core().welcome().station == "hand");
      CHECK(hand.world.server().station_count() == 1);
    }
}

TEST_CASE("Worlds with keys, made anew all the time, feel to the bit what worlds without keys feel") {
  int compared = 0;
  for (const std::uint64_t seed :
       {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 22}) {  // 16: keys that were never used were replaced
    const Scenario scenario = trusted_scenario(seed, true, true);
    if (restarts(scenario)) continue;
    RunOptions open, keyed;
    open.once = true;
    keyed.keys = WorldKeys{.times = quick_keys()};
    std::uint64_t handshakes = 0;
    keyed.prepare = [&](World& world) {
      world.at(scenario.end - Micros{1}, [&] {
        for (std::size_t k = 0; k < world.stations(); ++k)
          handshakes += world.trust().client(k, world.station(k).clock(world.now())).counts().handshakes;
      });
    };
    const WorldReport without = run_scenario(scenario, open), with = run_scenario(scenario, keyed);
    INFO("seed " << seed);
    CHECK(difference(without, with) == "none");
    CHECK(handshakes > 2 * scenario.stations.size());
    ++compared;
  }
  CHECK(compared > 6);
}

TEST_CASE("Somebody on the way, without a key, changes no bit of what is felt") {
  for (std::uint64_t seed = 1; seed <= 7; ++seed) {
    const Scenario scenario = trusted_scenario(seed, false, false);
    const AttackedRun quiet = run_with_keys(scenario, Attacker::none, Manner::careful),
                      attacked = run_with_keys(scenario, Attacker::stranger, Manner::careful);
    INFO("seed " << seed);
    CHECK(difference(quiet.report, attacked.report) == "none");
    CHECK(attacked.counts.injected > 500);
    CHECK(attacked.counts.before > 50);
    CHECK(attacked.counts.stray_bytes <= attacked.counts.injected_bytes);
    CHECK(quiet.report.patches_used > 0);
  }
}

TEST_CASE("Somebody on the way with the key of a station for another room changes no bit of what is felt") {
  for (std::uint64_t seed = 31; seed <= 35; ++seed) {
    const Scenario scenario = trusted_scenario(seed, false, false);
    const AttackedRun quiet = run_with_keys(scenario, Attacker::none, Manner::careful),
                      attacked = run_with_keys(scenario, Attacker::thief, Manner::careful);
    INFO("seed " << seed);
    CHECK(difference(quiet.report, attacked.report) == "none");
    CHECK(attacked.counts.stray_bytes > 0);  // the thief was answered: it has a session, which is of no use
  }
}

TEST_CASE("Worlds with keys hold every check while everything goes wrong and handshakes, joins and rejoins are attacked") {
  AttackCounts all;
  for (std::uint64_t seed = 57; seed <= 64; ++seed) {
    const Scenario scenario = trusted_scenario(seed, true, true, true);
    const AttackedRun run = run_with_keys(scenario, seed % 2 == 0 ? Attacker::thief : Attacker::stranger, Manner::ruthless);
    all.before += run.counts.before;
    all.cookies += run.counts.cookies;
    all.of_gone += run.counts.of_gone;
    for (const Violation& v : run.report.violations)
      FAIL_CHECK("seed " << seed << "\n  " << seconds(v.at) << " s  " << v.check << ": " << v.what);
  }
  CHECK(all.before > 1000);
  CHECK(all.cookies > 20);
  CHECK(all.of_gone > 100);
}

TEST_CASE("Attacked worlds that broke a check once hold every check") {
  struct Broken {
    std::uint64_t seed;
    bool small;
    double duration_s = 1.5;
  };
  for (const auto& [seed, small, duration_s] :
       {Broken{210046, false}, {210160, false}, {420089, true}, {709015, true, 3}, {737026, true, 3}}) {
    DrawOptions draw;
    draw.seed = seed;
    draw.duration_s = duration_s;
    draw.small = small;
    for (const Violation& v : run_attacked(draw).violations)
      FAIL_CHECK("seed " << seed << "\n  " << seconds(v.at) << " s  " << v.check << ": " << v.what);
  }
}
