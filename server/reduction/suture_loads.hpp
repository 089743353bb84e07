// The part of a patch that is the thread in the hand: the tool pulls it at its last bite (PatchSuture of patch.hpp).
//
// The body of a frame has threads in its forces and its stiffness (sutures.hpp). The client evaluates the one in its hand by
// itself, so a patch has g without its forces f, and on the modes V
//
//     V^T K V - sum_b k_b (V^T y_b)(V^T y_b)^T,     b over the parts of its stiffness
//
// which is positive semi-definite where K without threads is. The basis has the responses P^-1 g_i to the pull of each span.
#pragma once

#include "server/reduction/patch_parts.hpp"

namespace palpate {

/// Returns the loads of the thread that port `which` holds; `at`: with the coordinates of P, `solve`: P^-1 of columns. None if it
/// holds none, or a solve fails.
SutureLoads suture_loads(const FrameModel& frame, const Linearisation& at, SharedSystem& p, std::size_t which);
/// Adds the thread with its bites on the modes.
void add_suture(const LinearPort& model, const Matrix& v, PatchSuture& suture);

}  // namespace palpate
