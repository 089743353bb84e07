// The beginning that every experiment in the simulated world shares: a station joins, gets its first patch, the body calms down.
#pragma once

#include "bench/world/world.hpp"

namespace palpate {

/// Runs `world` until `station` has joined and, for a grasp, plays its first patch; and kSettle longer where taking up the tool
/// at `start` disturbs the body (needs_settling). Returns the first frame after that [world time]: motions begin there, so that
/// equal runs at other delays compare the same phases. Throws InputError when the station is refused, std::runtime_error when
/// nobody answers.
Micros join(World& world, WorldStation& station, const Scene& scene, const Vec3& start, const ClientOptions& options,
            double rate_hz);

}  // namespace palpate
