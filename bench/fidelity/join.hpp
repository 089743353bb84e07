// Common start of experiments in the simulated world: stations join and get their first patch, and the body settles.
#pragma once

#include <span>

#include "bench/world/world.hpp"
#include "common/motion/motion.hpp"
#include "common/wire/scheme_in_use.hpp"

namespace palpate {

/// Runs `world` until all `stations` have joined and, for a grasp, play their first patch. For touching tools it runs until the
/// clocks have locked over `link`, as a tool that starts in reach gets its first patch then. It runs kSettle longer if coupling a
/// tool at the start of its motion (`motions`, one each) disturbs the body (needs_settling). Returns the first frame after that
/// [world time]: motions begin there, so that equal runs with other delays compare the same phases. Throws InputError if a
/// station is refused, std::runtime_error if nobody answers.
Micros join(World& world, std::span<WorldStation* const> stations, const Scene& scene, std::span<const Motion> motions,
            SchemeAsked scheme, const LinkSpec& link, double rate_hz);

}  // namespace palpate
