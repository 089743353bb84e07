#include "bench/world/attacked.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace palpate {
namespace {

constexpr std::uint64_t kAttackerSeed = 1000;  ///< added to the world's seed

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

/// Two exchanges for keys, one each for Hello and the first sample, and repetitions meanwhile.
Micros time_to_join(const Scenario& scenario) {
  Micros round_trip{};
  for (const StationPlan& plan : scenario.stations) round_trip = std::max(round_trip, slowest(plan.up) + slowest(plan.down));
  return 4 * round_trip + kHelloEvery;
}

void judge_strays(const AttackCounts& counts, std::vector<Violation>& found) {
  if (counts.stray_bytes > counts.injected_bytes)
    found.push_back({Micros{}, "attack",
                     fmt::format("{} bytes to addresses of no station for {} bytes; expected no more than came",
                                 counts.stray_bytes, counts.injected_bytes)});
  if (counts.overdrawn > 0)
    found.push_back(
        {Micros{}, "attack",
         fmt::format("{} datagrams to addresses that never answered are more bytes than came from there; expected none",
                     counts.overdrawn)});
}

/// Compares a world without faults with and without the attacker.
std::vector<Violation> compare_quiet(DrawOptions draw, Attacker attacker) {
  draw.faults = draw.losses = false;
  Scenario scenario = draw_scenario(draw);
  scenario.end = std::min(scenario.end, scenario.healed + Adversary::kReplayAfter + time_to_join(scenario));
  FrameLog frames;
  RunOptions options;
  options.check = false;
  options.run_frame = frames.recorder();
  const AttackedRun quiet = run_with_keys(scenario, Attacker::none, Manner::careful, options);
  options.run_frame = frames.player();
  const AttackedRun attacked = run_with_keys(scenario, attacker, Manner::careful, options);
  std::vector<Violation> found;
  if (const auto tick = first_difference(quiet.report, attacked.report))
    found.push_back({Micros{}, "attack",
                     fmt::format("without faults and losses tick {} of {} is another one; expected the same bits as without the "
                                 "attacker",
                                 *tick, quiet.report.trail.size())});
  if (attacked.counts.injected == attacked.counts.before)
    found.push_back({Micros{}, "attack", "nothing was sent in anybody's name; expected all stations in, and then an attack"});
  judge_strays(attacked.counts, found);
  return found;
}

}  // namespace

ChannelTimes quick_keys() { return {.rekey = Micros{250'000}, .keep_old = Micros{10'000'000}, .stop = Micros{60'000'000}}; }

AttackedRun run_with_keys(const Scenario& scenario, Attacker attacker, Manner manner, RunOptions options) {
  options.keys.emplace();
  options.keys->times = quick_keys();
  options.keys->at_once = false;
  options.keys->more[public_of(stolen_key({}).self)] = of_another_room();
  std::unique_ptr<Adversary> adversary;
  options.prepare = [&](World& world) {
    if (attacker == Attacker::none) return;
    const auto stolen = attacker == Attacker::thief ? std::optional(stolen_key(world.trust().server_key())) : std::nullopt;
    adversary = std::make_unique<Adversary>(scenario.drawn_with.seed + kAttackerSeed, stolen, manner);
    adversary->attack(world, scenario.healed, scenario.end);
  };
  WorldReport report = run_scenario(scenario, options);
  return {std::move(report), adversary ? adversary->counts() : AttackCounts{}};
}

WorldReport run_attacked(DrawOptions draw, bool keep_rows) {
  const Attacker attacker = draw.seed % 2 == 0 ? Attacker::thief : Attacker::stranger;
  const Manner manner = attacker == Attacker::thief ? Manner::careful : Manner::ruthless;
  RunOptions options;
  options.keep_rows = keep_rows;
  draw.keys = true;
  const AttackedRun run = run_with_keys(draw_scenario(draw), attacker, manner, options);
  WorldReport report = run.report;
  std::vector<Violation> found = compare_quiet(draw, attacker);
  judge_strays(run.counts, found);
  report.violations.insert(report.violations.end(), found.begin(), found.end());
  return report;
}

std::optional<std::size_t> first_difference(const WorldReport& a, const WorldReport& b) {
  if (a.hash == b.hash && a.trail == b.trail) return std::nullopt;
  const auto at = std::mismatch(a.trail.begin(), a.trail.end(), b.trail.begin(), b.trail.end()).first;
  return static_cast<std::size_t>(at - a.trail.begin());
}

}  // namespace palpate
