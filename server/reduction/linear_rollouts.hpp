// Linear rollouts: likely motions of the linear body while a patch is in use, in few coordinates, and their dominant directions.
//
// A datagram holds fewer modes than the Krylov directions that a soft body needs, in which waves are still travelling when the
// next patch comes. So more candidates than modes are computed, W (M-orthonormal: W^T M W = 1), and in their coordinates q alone
// the body is stepped over tau = 2 / s, from rest unless stated otherwise:
//
//     q'' + D q' + K q = f(t),    D = W^T D W,  K = W^T K W
//
//     own motion   f = W^T (F + sum B lambda) + D q'(0),  q'(0) = W^T M v*     the body moves on, the tool keeps its forces
//     step, ramp   f = a_i W^T B e_i   and   f = a_i W^T B e_i t / tau     pushed along each axis i; of a tool with a body also
//                  along and about each axis by all its contacts together (ToolLoad of patch_parts.hpp)
//     slide        f = W^T (B_end lambda_end - B lambda) t / tau           the load of a tool that slides on
//
// with a_i such that the port has moved by kPushedM along i at the end, or by less where a hand does not turn it that far. With C
// the mean of q q^T over all steps and trajectories and E = K + s D + s^2 = L L^T,
//
//     L^T C L = U Lambda U^T,     Q = the leading columns of L^-T U, made orthonormal
//
// so W Q spans these motions, weighted by energy. No candidate is used unchanged: the port responses and M^-1 B themselves would
// displace better ones.
//
// Shapes: c candidates; D, K, C, E c x c, W^T B c x 3; Q c x count. If K is not definite, its eigenvalues enter by their absolute
// values: a snapping body would fill all directions with one motion.
// Method: trapezoidal rule in kRolloutSteps steps. Sources: the method of snapshots, Sirovich, Quart. Appl. Math. 45 (1987);
// energy as the weight, Rathinam and Petzold, SIAM J. Numer. Anal. 41 (2003).
#pragma once

#include "server/reduction/basis.hpp"

namespace palpate {

/// Loads in the coordinates of the candidates.
struct RolloutLoads {
  Matrix port;      ///< W^T B, c x 3, or more with the wrenches of a body
  Vector most_m;    ///< largest displacement by each of these
  Vector own;       ///< W^T (F + sum B lambda), over the tool's contacts
  Vector velocity;  ///< W^T M v*
  Matrix slides;    ///< W^T (B_end lambda_end - B lambda), one column per slide; may have none
};

/// Returns Q; `on_candidates` has K and D, s > 0, 1 <= count. Returns fewer columns if there are fewer candidates.
Matrix dominant_directions(const Projection& on_candidates, const RolloutLoads& loads, double shift_1_s, Eigen::Index count);

}  // namespace palpate
