// What limits a patch: the force that a hand would have felt of models that nothing is left out of, over the same patches.
//
// Of every frame of a replay that keeps them (replay.hpp) the body's state, its port and the modes of the patch. In each tick the
// model of the patch that was played then has come from its stamp, along the tool's true path, to that tick:
//
//     full_forces     M_r y'' = V^T (F(x* + V y, ...) + B lambda)      the body's own forces on the modes of the patch
//     whole_linear    M w'' = F* - K w - D (w' - v*) + B lambda        the whole body, linearised at the stamp
//
// in ticks of 1 ms by the trapezoid, what the forces have beyond the linear ones where the step before leads to; full forces in
// two steps or as many as are stable. Dampers for which these would have to be more than eight are linear in each tick, as they
// are halfway through it. The contact is the server's: the whole skin and the same law (contact_law.hpp). Neither wire,
// cross-fade nor guard have a part in it. Of bodies whose stress does not fade: the forces here know no history.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bench/fidelity/replay.hpp"

namespace palpate {

enum class LocalModel : std::uint8_t { full_forces, whole_linear };

/// On the tool [N], for every tick of the path; nothing where there was no patch (`ages`, of the one that was played, negative)
/// and, for full_forces, where it had no modes of its own: it was none of scheme `hyper`. `starts` ascend.
std::vector<std::optional<Vec3>> local_forces(const Scene& scene, const ToolPath& path, std::span<const Micros> ages,
                                              std::span<const LocalStart> starts, LocalModel model);

/// The run as it would have been felt with such a model in place of every patch that has one, those of `starts`: its ticks'
/// forces and its fidelity are changed.
void replace_patches(ReplayResult& result, const Scene& scene, LocalModel model);

}  // namespace palpate
