// Upper bound of the fidelity on a body with several hands: the full model replaces every patch.
//
// A patch with stamp t* is made from the true state of the body at t* and played on the hand's own true path. The motion of the
// other hands is known until t* and has to be predicted beyond it, until the patch is replaced. Here the 1 kHz full model
// branches at every t* and continues with the hand's true path and the predicted paths of the others:
//
//     felt_a(t) = force of tool a in the branch of the patch that was played at t
//
// No scheme with the same prediction can be more accurate, except by chance. The branches have no cross-fade.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "bench/fidelity/reference.hpp"
#include "server/reduction/tool_prediction.hpp"

namespace palpate {

/// Predicts the path of a tool from its positions `past` at 0, 1, 2, ... ms, the last of them now.
using PathPrediction = std::function<ToolAt(std::span<const Vec3> past, double after_s)>;
ToolAt predicted_to_rest(std::span<const Vec3> past, double after_s);   ///< dead_reckoned(), from the velocity over 8 ms
ToolAt predicted_to_go_on(std::span<const Vec3> past, double after_s);  ///< moved_on(), from a parabola over 60 ms

struct CeilingForce {
  ReferenceForce felt;
  std::vector<double> steps_n;  ///< force steps between the branches of two patches at their hand-over [N]
};

/// Bound for each path. `stamp_ms[a][i]` is the stamp of the patch that hand a played at i ms, in ms into the paths, ascending;
/// below 0: no patch, no force. `held`: as of ReferenceModel. Throws what reference_forces() throws.
std::vector<CeilingForce> ceiling_forces(const Scene& scene, std::span<const ToolPath> paths,
                                         std::span<const std::vector<int>> stamp_ms, const PathPrediction& prediction,
                                         const std::function<void(double)>& progress = {},
                                         std::span<const std::uint8_t> held = {});

}  // namespace palpate
