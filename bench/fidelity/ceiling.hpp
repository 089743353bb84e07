// What a hand could feel at most of a body that others touch, too: the full model in the place of every patch.
//
// A patch with stamp t* is made of the body as it truly is at t* and is played on the hand's own true path. Of the other hands it
// knows how they moved until t*; where they go until it is replaced it can only predict. Here the 1 kHz full model is branched
// off at every t* and goes on with the hand's true path and the predicted ones of the others:
//
//     felt_a(t) = force of tool a in the branch of the patch that was played at t
//
// No scheme that predicts in the same way can be nearer to the truth but by chance. The branches have no cross-fade.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "bench/fidelity/reference.hpp"
#include "server/reduce/tool_prediction.hpp"

namespace palpate {

/// Where a tool goes that was at `past`, 0, 1, 2, ... ms, the last of these now.
using PathPrediction = std::function<ToolAt(std::span<const Vec3> past, double after_s)>;
ToolAt predicted_to_rest(std::span<const Vec3> past, double after_s);   ///< dead_reckoned(), from the velocity of 8 ms
ToolAt predicted_to_go_on(std::span<const Vec3> past, double after_s);  ///< moved_on(), from the parabola of 60 ms

struct CeilingForce {
  ReferenceForce felt;
  std::vector<double> steps_n;  ///< between the branches of two patches where the next takes over [N]
};

/// For each path. `stamp_ms[a][i]`: the stamp of the patch that hand a played at i ms, ms into the paths, ascending; below 0
/// none, and nothing is felt. Throws what reference_forces() throws.
std::vector<CeilingForce> ceiling_forces(const Scene& scene, std::span<const ToolPath> paths,
                                         std::span<const std::vector<int>> stamp_ms, const PathPrediction& prediction,
                                         const std::function<void(double)>& progress = {});

}  // namespace palpate
