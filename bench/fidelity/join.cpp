#include "bench/fidelity/join.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "bench/fidelity/reference.hpp"
#include "common/base/error.hpp"
#include "common/base/grasp_reach.hpp"

namespace palpate {
namespace {

constexpr Micros kJoinWithin{60'000'000}, kClocksLock{300'000};

/// Throws an InputError; the server's text may contain what it expected.
[[noreturn]] void refuse(SchemeAsked scheme, const std::string& refusal) {
  constexpr std::string_view kExpected = "; expected ";
  const auto at = refusal.find(kExpected);
  throw InputError("--scheme " + std::string(name_of(scheme)), "refused by the server: " + refusal.substr(0, at),
                   at == std::string::npos ? "a scheme and order that it takes" : refusal.substr(at + kExpected.size()));
}

bool waits(WorldStation& station, SchemeAsked scheme, bool wants_patch) {
  const ClientCore& core = station.core();
  if (core.link() == LinkState::refused) refuse(scheme, core.refusal());
  return core.link() != LinkState::joined || (wants_patch && station.core().haptic().counts().patches_used == 0);
}

void check_reach(const Scene& scene, const Motion& motion) {
  const double away_m = (motion.position(0.0) - scene.body.nodes[scene.tool.node]).norm();
  if (away_m <= kGraspReachM) return;
  throw InputError("motion",
                   fmt::format("starts {:.0f} mm from the node that the tool of scene {} holds", 1e3 * away_m, scene.name),
                   fmt::format("at most {:.0f} mm: from further away nobody grasps it", 1e3 * kGraspReachM));
}

}  // namespace

Micros join(World& world, std::span<WorldStation* const> stations, const Scene& scene, std::span<const Motion> motions,
            SchemeAsked scheme, const LinkSpec& link, double rate_hz) {
  const bool wants_patch = scene.tool.contact == ContactKind::attach;
  if (wants_patch)
    for (const Motion& motion : motions) check_reach(scene, motion);
  for (WorldStation* station : stations)
    while (waits(*station, scheme, wants_patch)) {
      if (world.now() > kJoinWithin) throw std::runtime_error("no answer over this link within 60 s of virtual time");
      world.run_until(world.now() + Micros{1000});
    }
  if (!wants_patch) world.run_until(world.now() + kClocksLock + 4 * link.latency);
  const bool settle = std::any_of(motions.begin(), motions.end(),
                                  [&](const Motion& motion) { return needs_settling(scene, motion.position(0.0)); });
  if (settle) world.run_until(world.now() + kSettle);
  const Micros frame = from_seconds(1 / rate_hz);
  return (world.now() / frame + 1) * frame;
}

}  // namespace palpate
