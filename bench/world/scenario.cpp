#include "bench/world/scenario.hpp"

#include <algorithm>
#include <cmath>

#include "bench/world/draw.hpp"
#include "common/base/sort_stably.hpp"
#include "common/trust/client_channel.hpp"
#include "server/core/server_core.hpp"

namespace palpate {

const char* describe(FaultKind kind) {
  constexpr std::array<const char*, kFaultKinds> kNames{"link cut towards the server",
                                                        "link cut towards the station",
                                                        "link cut",
                                                        "storm on the link",
                                                        "path changes",
                                                        "network thread stalls",
                                                        "haptic thread stalls",
                                                        "crashes",
                                                        "leaves",
                                                        "clock steps ahead",
                                                        "machine sleeps",
                                                        "server stalls",
                                                        "server dies",
                                                        "server's clock steps ahead"};
  return kNames[static_cast<std::size_t>(kind)];
}

bool is_of_server(FaultKind kind) { return kind >= FaultKind::server_stall; }

Micros slowest(const LinkSpec& link) {
  return link.latency + link.jitter + (link.reorder > 0 ? LinkModel::kReorderHold : Micros{});
}

Links healed_links(const Scenario& scenario, std::size_t station) {
  Links links{scenario.stations[station].up, scenario.stations[station].down};
  for (const Fault& f : scenario.faults)
    if (f.kind == FaultKind::path_change && f.station == static_cast<int>(station))
      links.up.latency = links.down.latency = from_seconds(f.amount);
  for (LinkSpec* link : {&links.up, &links.down}) {
    link->loss = link->duplicate = link->reorder = 0;
    link->jitter = std::min(link->jitter, link->latency);
  }
  return links;
}

Micros slowest_ever(const Scenario& s, std::size_t station, bool up) {
  const StationPlan& plan = s.stations[station];
  const Links healed = healed_links(s, station);
  return std::max(slowest(up ? plan.up : plan.down), slowest(up ? healed.up : healed.down)) + LinkModel::kReorderHold;
}

Micros misjudged_for(const Scenario& s, const Fault& f) {
  if (f.kind != FaultKind::clock_step && f.kind != FaultKind::sleep && f.kind != FaultKind::server_clock_step) return {};
  const Micros step = f.kind == FaultKind::sleep ? f.end - f.begin : from_seconds(f.amount);
  Micros round_trip{};
  for (std::size_t k = 0; k < s.stations.size(); ++k)
    round_trip = std::max(round_trip, slowest_ever(s, k, true) + slowest_ever(s, k, false));
  return step <= round_trip + ClockSync::kStepLeast ? WindowedMinimum::kWindow : Micros{};
}

Micros recovery_time(const Scenario& scenario, std::size_t station) {
  // A crashed process is silent for kSilentAfter before its name is free; a refused one asks again after kRetryEvery. With keys
  // it waits until the old one has failed to echo, and asks again meanwhile; two exchanges make its keys, as with a restarted
  // server, with at most one handshake per second. A shadow first waits for the station whose tool it shares. Then there are
  // three exchanges (refused as unknown, Hello, samples) and, in the worst case, a frame as long as a stall.
  const auto slow = [&](std::size_t k) {
    const Links links = healed_links(scenario, k);
    return slowest(links.up) + slowest(links.down);
  };
  const StationPlan& plan = scenario.stations[station];
  const Micros frame = from_seconds(1 / scenario.rate_hz) + scenario.compute;
  const bool new_keys =
      scenario.drawn_with.keys && std::any_of(scenario.faults.begin(), scenario.faults.end(),
                                              [](const Fault& f) { return f.kind == FaultKind::server_restart; });
  const int exchanges = new_keys ? 6 : 4;
  Micros joins = kHelloEvery + exchanges * slow(station) + (new_keys ? kBeginEvery : Micros{});
  if (plan.owner >= 0) joins += kRetryEvery + exchanges * slow(static_cast<std::size_t>(plan.owner));
  const int self = plan.owner >= 0 ? plan.owner : static_cast<int>(station);
  for (const Fault& f : scenario.faults)
    if (f.station == self && (f.kind == FaultKind::crash || f.kind == FaultKind::leave)) {
      const Micros ever = slowest_ever(scenario, station, true) + slowest_ever(scenario, station, false);
      joins += scenario.drawn_with.keys ? ever + kSuccessorProof + kHelloEvery + 2 * slow(station) : kSilentAfter + kRetryEvery;
      break;
    }
  return Micros{500'000} + joins + 6 * frame;
}

Micros recovered_by(const Scenario& scenario, std::size_t station) {
  const Micros recovery = recovery_time(scenario, station);
  Micros by = scenario.healed + recovery;
  for (const Fault& f : scenario.faults)
    if (const Micros misjudged = misjudged_for(scenario, f); misjudged > Micros{})
      by = std::max(by, f.end + misjudged + recovery);
  return by;
}

namespace {

void draw_server(Scenario& s) {
  Random random = part_of(s.drawn_with.seed, Part::server);
  s.rate_hz = pick(random, {10.0, 15.0, 20.0, 30.0, 50.0, 60.0});
  const double compute_max_s = random.chance(0.05) ? 1.3 / s.rate_hz : 0.5 / s.rate_hz;
  s.compute = random.chance(0.4) ? Micros{} : from_seconds(random.uniform(0, compute_max_s));
  const double drift = random.uniform(-100, 100);
  s.server_drift_ppm = s.drawn_with.drift ? drift : 0;
}

/// Draws any kind but `sleep`.
FaultKind draw_kind(Random& random) {
  const auto kind = random.bits() % (kFaultKinds - 1);
  return static_cast<FaultKind>(kind < static_cast<std::uint64_t>(FaultKind::sleep) ? kind : kind + 1);
}

double draw_amount(FaultKind kind, Random& random) {
  const double share = random.uniform();
  switch (kind) {
    case FaultKind::storm:
      return 0.3 + 0.5 * share;
    case FaultKind::path_change:
      return std::pow(10, -3 + 2.4 * share);
    case FaultKind::clock_step:
    case FaultKind::server_clock_step:
      return std::pow(10, -3 + 3.3 * share);
    case FaultKind::server_restart:
      return share < 0.5 ? 1 : 0;
    default:
      return 0;
  }
}

/// Always drawn, so that later draws do not depend on whether there are faults.
std::vector<Fault> draw_faults(const Scenario& s) {
  Random random = part_of(s.drawn_with.seed, Part::faults);
  std::vector<Fault> faults;
  const auto count = 1 + random.bits() % 4;
  for (std::uint64_t k = 0; k < count; ++k) {
    Fault f;
    f.kind = draw_kind(random);
    const auto station = static_cast<int>(random.bits() % s.stations.size());
    f.station = is_of_server(f.kind) ? -1 : station;
    const double first = seconds(kFirstFaultAt), last = seconds(s.healed);
    f.begin = from_seconds(random.uniform(first, std::max(first, last - 0.05)));
    // Many are short, some last until everything is healed.
    f.end = std::min(s.healed, f.begin + from_seconds(std::pow(10, random.uniform(-2, 0.55))));
    f.amount = draw_amount(f.kind, random);
    faults.push_back(f);
  }
  Random sleep = part_of(s.drawn_with.seed, Part::sleep);
  if (sleep.chance(0.1)) {
    const Micros begin = from_seconds(sleep.uniform(seconds(kFirstFaultAt), seconds(s.healed) - 0.05));
    const auto station = static_cast<int>(sleep.bits() % s.stations.size());
    faults.push_back({FaultKind::sleep, s.stations[static_cast<std::size_t>(station)].owner < 0 ? station : 0, begin,
                      std::min(s.healed, begin + from_seconds(std::pow(10, sleep.uniform(-2, 0.55)))), 0});
  }
  sort_stably(faults.begin(), faults.end(), [](const Fault& a, const Fault& b) { return a.begin < b.begin; });
  return faults;
}

}  // namespace

Scenario draw_scenario(const DrawOptions& options) {
  Scenario s;
  s.drawn_with = options;
  s.healed = from_seconds(options.duration_s);
  s.rest = s.healed + Micros{400'000};
  s.scene_json = draw_scene(options.seed, options.small);
  s.scene = read_scene(s.scene_json, "the scene of seed " + std::to_string(options.seed));
  draw_server(s);
  s.stations = draw_stations(s);
  if (options.faults) s.faults = draw_faults(s);
  // A hand follows the clock of its machine, which stands still while the machine sleeps.
  for (const Fault& f : s.faults)
    if (f.kind == FaultKind::sleep) s.rest += f.end - f.begin;
  s.end = s.rest + kComesToRest;
  for (std::size_t k = 0; k < s.stations.size(); ++k) s.end = std::max(s.end, recovered_by(s, k) + kComesToRest);
  // Time for patches stamped after that to arrive.
  Micros way{};
  for (std::size_t k = 0; k < s.stations.size(); ++k) {
    const Links links = healed_links(s, k);
    way = std::max(way, slowest(links.up) + slowest(links.down));
  }
  s.end += 2 * way + s.compute + from_seconds(4 / s.rate_hz) + Micros{200'000};
  return s;
}

}  // namespace palpate
