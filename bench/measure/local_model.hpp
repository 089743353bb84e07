// What limits a patch: the force that a hand would have felt of models that nothing is left out of, over the same patches.
//
// Of every frame of a replay that keeps them (replay.hpp) the body's state, its port and the modes of the patch. In each tick the
// model of the patch that was played then has come from its stamp, along the tool's true path, to that tick:
//
//     full_forces     M_r y'' = V^T (F(x* + V y, ...) + B lambda)      the body's own forces on the modes of the patch, which
//                                                                      yields at once beside them as the patch does
//     whole_linear    M w'' = F* - K w - D (w' - v*) + B lambda        the whole body, linearised at the stamp
//
// in ticks of 1 ms by the trapezoid, what the forces have beyond the linear ones where the step before leads to; full forces in
// two steps or as many as are stable. Dampers for which these would have to be more than eight are linear in each tick, as they
// are halfway through it. The contact is the server's: the whole skin and the same law (contact_law.hpp). Neither wire,
// cross-fade nor guard have a part in it.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bench/measure/reference.hpp"
#include "server/body/stepper.hpp"

namespace palpate {

enum class LocalModel : std::uint8_t { full_forces, whole_linear };

/// A frame in which a patch was built.
struct LocalStart {
  Micros stamp{};  ///< into the motion
  BodyState body;  ///< there
  ToolPort port;   ///< there
  Matrix modes;    ///< V, 3 N x r, orthonormal in M
  /// Of a touch: what the point under the tool yields at once beside the modes, C_s of the patch [m/N].
  Mat3 residual = Mat3::Zero();
};

/// On the tool [N], for every tick of the path; nothing where there was no patch (`ages`, of the one that was played, negative)
/// and, for full_forces, where it had no modes of its own: it was none of scheme `cubic`. `starts` ascend.
std::vector<std::optional<Vec3>> local_forces(const Scene& scene, const ToolPath& path, std::span<const Micros> ages,
                                              std::span<const LocalStart> starts, LocalModel model);

}  // namespace palpate
