#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/world/draw.hpp"
#include "common/wire/codec.hpp"

namespace palpate {
namespace {

/// Log-uniform.
double spread(Random& random, double low, double high) { return low * std::pow(high / low, random.uniform()); }

LinkSpec draw_link(Random& random, double latency_s, bool losses) {
  LinkSpec link;
  link.latency = from_seconds(latency_s * random.uniform(0.75, 1.3));
  link.jitter = from_seconds(std::min(random.chance(0.3) ? 0.0 : random.uniform(0, 0.02), 0.5 * latency_s));
  const double loss = random.chance(0.4) ? 0.0 : spread(random, 0.002, 0.3);
  const double burst = random.chance(0.5) ? 0.0 : random.uniform(2, 6);
  const double duplicate = random.chance(0.6) ? 0.0 : random.uniform(0, 0.1);
  const double reorder = random.chance(0.6) ? 0.0 : random.uniform(0, 0.1);
  if (losses) {
    link.loss = loss;
    link.burst_mean = burst;
    link.duplicate = duplicate;
    link.reorder = reorder;
  }
  link.seed = random.bits();
  return link;
}

void draw_links(const Scenario& s, std::size_t index, StationPlan& plan) {
  Random random = part_of(s.drawn_with.seed, Part::link, index);
  const double latency_s = random.chance(0.05) ? random.uniform(0.2, 0.5) : spread(random, 0.0002, 0.12);
  plan.up = draw_link(random, latency_s, s.drawn_with.losses);
  plan.down = draw_link(random, latency_s, s.drawn_with.losses);
}

void draw_clock(const Scenario& s, std::size_t index, StationPlan& plan) {
  Random random = part_of(s.drawn_with.seed, Part::clock, index);
  const double drift = random.uniform(-100, 100);
  plan.drift_ppm = s.drawn_with.drift ? drift : 0;
}

/// With too few states the patch of a touch does not hold a hand still (bench/simulated-worlds.md).
int draw_order(const Scenario& s, Random& random) {
  constexpr int kModesLeast = 5;
  const int most = max_port_modes(s.scene.tool.contact);
  const bool usual = random.chance(0.6);
  const auto more = random.bits() % static_cast<std::uint64_t>(most - kModesLeast + 1);
  return usual ? 0 : 2 * (kModesLeast + static_cast<int>(more));
}

/// A simulated hand may well be unstable with the schemes that Palpate replaced, so only a recorded motion feels them.
Scheme draw_scheme(const Scenario& s, std::uint64_t index, Random& random, bool any) {
  const bool another = random.chance(0.4);
  const Scheme replaced = pick(random, {Scheme::hold, Scheme::tangent, Scheme::ring, Scheme::port});
  if (any && another) return replaced;
  Random of_ours = part_of(s.drawn_with.seed, Part::scheme, index);
  return pick(of_ours, {Scheme::port, Scheme::hyper});
}

void draw_hand(const Scenario& s, std::size_t index, StationPlan& plan) {
  Random random = part_of(s.drawn_with.seed, Part::hand, index);
  plan.hand = pick(random, {"light", "reference", "reference", "firm"});
  plan.phantom.hand = *hand_from_name(plan.hand);
  plan.phantom.tremor_m = random.uniform(0, 2e-4);
  plan.phantom.seed = random.bits();
  const double release_s = random.uniform(seconds(kFirstFaultAt), seconds(s.healed));
  if (random.chance(0.1)) plan.phantom.release_s = release_s;
  plan.simulated = random.chance(0.7);
}

StationPlan draw_station(const Scenario& s, std::size_t index) {
  StationPlan plan;
  draw_hand(s, index, plan);
  draw_links(s, index, plan);
  draw_clock(s, index, plan);
  const std::uint64_t part = 1 + index;
  Random random = part_of(s.drawn_with.seed, Part::stations, part);
  plan.client.hello.station = fmt::format("hand{}", index);
  plan.client.hello.scheme = draw_scheme(s, part, random, !plan.simulated);
  plan.client.hello.order = static_cast<std::uint16_t>(draw_order(s, random));
  const SimPhantomOptions device;
  plan.client.guard = {device.force_max_n, SimPhantom::kSlewMaxNS, PassivityMode::on};
  return plan;
}

void make_shadow(const Scenario& s, StationPlan& plan, int owner, const StationPlan& of) {
  const std::uint64_t part = 1000 + static_cast<std::uint64_t>(owner);
  Random random = part_of(s.drawn_with.seed, Part::stations, part);
  plan.owner = owner;
  plan.drift_ppm = of.drift_ppm;
  plan.client.hello.shadow_of = of.client.hello.station;
  plan.client.hello.scheme = draw_scheme(s, part, random, true);
  plan.client.hello.station = of.client.hello.station + "-shadow";  // a name that its key may use
}

}  // namespace

std::vector<StationPlan> draw_stations(const Scenario& s) {
  Random random = part_of(s.drawn_with.seed, Part::stations);
  const bool attach = s.scene.tool.contact == ContactKind::attach;
  const auto hands = std::min(static_cast<std::uint64_t>(s.drawn_with.stations_max),
                              attach ? 1 : pick<std::uint64_t>(random, {1, 1, 1, 2, 2, 3}));
  const bool shadow = random.chance(0.25), viewer = random.chance(0.25);
  std::vector<StationPlan> plans;
  for (std::uint64_t k = 0; k < hands; ++k) {
    plans.push_back(draw_station(s, k));
    plans.back().path = draw_path(s, k, hands);
  }
  const auto room_for = [&] { return plans.size() < static_cast<std::size_t>(s.drawn_with.stations_max); };
  if (shadow && room_for()) {
    plans.push_back(draw_station(s, plans.size()));
    make_shadow(s, plans.back(), 0, plans[0]);
  }
  if (viewer && room_for()) {
    plans.push_back(draw_station(s, plans.size()));
    plans.back().client.hello.role = Role::viewer;
    plans.back().client.hello.station = "viewer";
  }
  return plans;
}

}  // namespace palpate
