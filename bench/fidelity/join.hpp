// The beginning that every experiment in the simulated world shares: stations join, get their first patch, the body calms down.
#pragma once

#include <span>

#include "bench/world/world.hpp"
#include "common/motion/motion.hpp"
#include "common/wire/scheme_in_use.hpp"

namespace palpate {

/// Runs `world` until all `stations` have joined and, for a grasp, play their first patch; where tools only touch, until the
/// clocks have locked over `link`, since a tool that starts in reach gets its first patch then; and kSettle longer where taking
/// up a tool at the start of its motion (`motions`, one each) disturbs the body (needs_settling). Returns the first frame after
/// that [world time]: motions begin there, so that equal runs at other delays compare the same phases. Throws InputError when a
/// station is refused, std::runtime_error when nobody answers.
Micros join(World& world, std::span<WorldStation* const> stations, const Scene& scene, std::span<const Motion> motions,
            SchemeAsked scheme, const LinkSpec& link, double rate_hz);

}  // namespace palpate
