// Limits of a patch: the forces of models from which nothing is omitted, played in place of the same patches.
//
// For every frame of a replay that keeps them (replay.hpp), the body's state, its port and the modes of the patch are known. In
// each tick, the model of the patch that was played then has been integrated from its stamp, along the tool's true path, to that
// tick:
//
//     full_forces     M_r y'' = V^T (F(x* + V y, ...) + B lambda)      the body's own forces on the modes of the patch
//     whole_linear    M w'' = F* - K w - D (w' - v*) + B lambda        the whole body, linearised at the stamp
//
// in ticks of 1 ms by the trapezoidal rule; the nonlinear part of the forces is evaluated where the previous step leads to.
// full_forces takes two steps per tick, or as many as are stable. Dampers that would require more than eight are linearised in
// each tick, at their state halfway through it. The contact is the server's: the whole skin and the same law (contact_law.hpp).
// Wire, cross-fade and guard are bypassed. Bodies with relaxation are not supported, as the forces here have no history.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bench/fidelity/replay.hpp"

namespace palpate {

enum class LocalModel : std::uint8_t { full_forces, whole_linear };

/// Forces on the tool [N] for every tick of the path; empty without a patch (negative entry of `ages`, the ages of the played
/// patches) and, for full_forces, for a patch without modes of its own, which was not of scheme `hyper`. `starts` ascend.
std::vector<std::optional<Vec3>> local_forces(const Scene& scene, const ToolPath& path, std::span<const Micros> ages,
                                              std::span<const LocalStart> starts, LocalModel model);

/// Replaces the forces of a run by those of such a model, for every patch in `starts`, and recomputes the fidelity.
void replace_patches(ReplayResult& result, const Scene& scene, LocalModel model);

}  // namespace palpate
