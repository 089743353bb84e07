// Motions of several tools on the top of one body, for measuring how stations feel each other through the tissue.
#pragma once

#include <vector>

#include "common/motion/motion.hpp"
#include "server/room/room.hpp"

namespace palpate {

/// Place of tool k of `count` relative to the middle, `apart_m` from its neighbours: two in a row along x, more on a spiral of
/// even density (Vogel).
Eigen::Vector2d place_apart(int k, int count, double apart_m);

/// Returns `count` motions of `duration_s`. Tools stand over the points of the top at place_apart() from its
/// middle. Each comes down from kAbove over its own surface point, 0.1 s after the one before (at most half a second in all),
/// presses kDeep and then oscillates by kSwing around it, at a frequency of its own between 0.7 and 1.5 Hz. With `slide_m` every
/// other tool strokes to and fro along y by that much each way, at the same frequency. Throws InputError if a tool would miss the
/// body.
std::vector<Motion> tools_apart(const Scene& scene, int count, double apart_m, double duration_s, double slide_m = 0);

}  // namespace palpate
