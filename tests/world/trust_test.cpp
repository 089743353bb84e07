// The trust channel in the simulated world: it changes nothing that is felt, and neither does anybody who has no key for the
// room.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/world/adversary.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kDurationS = 1.2;

/// New keys all the time; old ones open for as long as anything is under way.
ChannelTimes quick() { return {.rekey = Micros{250'000}, .keep_old = Micros{10'000'000}, .stop = Micros{60'000'000}}; }

Scenario scenario_of(std::uint64_t seed, bool faults, bool losses) {
  DrawOptions draw;
  draw.seed = seed;
  draw.duration_s = kDurationS;
  draw.faults = faults;
  draw.losses = losses;
  return draw_scenario(draw);
}

bool restarts(const Scenario& scenario) {
  return std::any_of(scenario.faults.begin(), scenario.faults.end(),
                     [](const Fault& fault) { return fault.kind == FaultKind::server_restart; });
}

ClientKeys stolen_key(const PublicKey& server) {
  SecretKey key;
  key.bytes.fill(42);
  return {key, server, {}};
}

Rights of_another_room() {
  Rights rights;
  rights.name = "thief";
  rights.hand = rights.viewer = true;
  rights.rooms = {"another room"};
  return rights;
}

WorldReport run_attacked(const Scenario& scenario, bool attacked, bool with_key, bool at_once, AttackCounts& counts) {
  RunOptions options;
  options.keys.emplace();
  options.keys->times = quick();
  options.keys->at_once = at_once;
  options.keys->more[public_of(stolen_key({}).self)] = of_another_room();
  std::unique_ptr<Adversary> adversary;
  options.prepare = [&](World& world) {
    if (!attacked) return;
    const auto stolen = with_key ? std::optional(stolen_key(world.trust().server_key())) : std::nullopt;
    adversary = std::make_unique<Adversary>(scenario.drawn_with.seed + 1000, stolen, counts);
    adversary->attack(world, scenario.end);
  };
  return run_scenario(scenario, options);
}

/// Of every force felt and every datagram of the session, by their hash after each tick.
std::string first_difference(const WorldReport& a, const WorldReport& b) {
  if (a.hash == b.hash && a.trail == b.trail) return "none";
  const auto at = std::mismatch(a.trail.begin(), a.trail.end(), b.trail.begin(), b.trail.end()).first - a.trail.begin();
  return "from tick " + std::to_string(at) + " of " + std::to_string(a.trail.size());
}

}  // namespace

TEST_CASE("Worlds with keys, made anew all the time, feel to the bit what worlds without keys feel") {
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Scenario scenario = scenario_of(seed, true, true);
    if (restarts(scenario)) continue;  // a server that restarted has other keys, and what is under way to it is of no use
    RunOptions open, keyed;
    open.once = true;
    keyed.keys = WorldKeys{.times = quick()};
    std::uint64_t handshakes = 0;
    keyed.prepare = [&](World& world) {
      world.at(scenario.end - Micros{1}, [&] {
        for (std::size_t k = 0; k < world.stations(); ++k)
          handshakes += world.trust().client(k, world.station(k).clock(world.now())).counts().handshakes;
      });
    };
    const WorldReport without = run_scenario(scenario, open), with = run_scenario(scenario, keyed);
    INFO("seed " << seed);
    CHECK(first_difference(with, without) == "none");
    CHECK(handshakes > 2 * scenario.stations.size());
    ++compared;
  }
  CHECK(compared > 25);
}

TEST_CASE("Somebody on the way, without a key, changes no bit of what is felt") {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Scenario scenario = scenario_of(seed, false, false);
    AttackCounts counts, none;
    const WorldReport quiet = run_attacked(scenario, false, false, false, none);
    const WorldReport attacked = run_attacked(scenario, true, false, false, counts);
    INFO("seed " << seed);
    CHECK(first_difference(attacked, quiet) == "none");
    CHECK(counts.injected > 500);
    CHECK(counts.stray_bytes <= counts.injected_bytes);
    CHECK(quiet.patches_used > 0);
  }
}

TEST_CASE("Somebody on the way with the key of a station for another room changes no bit of what is felt") {
  for (std::uint64_t seed = 31; seed <= 50; ++seed) {
    const Scenario scenario = scenario_of(seed, false, false);
    AttackCounts counts, none;
    const WorldReport quiet = run_attacked(scenario, false, false, false, none);
    const WorldReport attacked = run_attacked(scenario, true, true, false, counts);
    INFO("seed " << seed);
    CHECK(first_difference(attacked, quiet) == "none");
    CHECK(counts.stray_bytes > 0);  // the thief was answered: the session is there, and of no use
  }
}

TEST_CASE("Worlds with keys hold every check while everything goes wrong and somebody is on the way") {
  for (std::uint64_t seed = 51; seed <= 80; ++seed) {
    const Scenario scenario = scenario_of(seed, true, true);
    AttackCounts counts;
    const WorldReport report = run_attacked(scenario, true, seed % 2 == 0, false, counts);
    for (const Violation& v : report.violations)
      FAIL_CHECK("seed " << seed << "\n  " << seconds(v.at) << " s  " << v.check << ": " << v.what);
  }
}
