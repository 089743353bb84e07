// A basis for a nonlinear patch: what the body is likely to do until the next patch takes over, to second order.
//
// Candidate shapes w_c (3 N), each as large as the prediction horizon tau is likely to make it, at P = s^2 M + s D + K:
//     P^-1 B a_i                          the port's motion, a_i how far or hard it moves; and their next moments,
//                                         X <- s P^-1 (2 s M + D) X
//     P^-1 (B_end lambda_end - B lambda)  the load of a touching tool where it may have slid to (tool_prediction.hpp)
//     tau v*,   P^-1 F*,   s P^-1 M v*    the body's own motion
//     P^-1 F2(b_i, b_j)                   what bends when shapes b_i and b_j act together: F2 the second-order forces,
//                                         b of {port shapes, tau v*}; of a touch instead
//     w(a)                                indentations as deep as the hand may make them, by the body's own forces
//     (static_indentation.hpp) x(t_k) - x*                         where the body was in the last frames: it often comes back;
//     where it rests; and where
//                                         it may be, in each rollout of the hands
// and of all of them the directions that carry most energy: leading eigenvectors of W^T P W. The last kind is worth 8 dB at
// 150 ms with 13 modes on scenes/cube6.json. Beside them, of a touch, one that has little energy and all the haste,
//     M^-1 B n                            how the body begins to yield along the normal n: what an onset is made of
// worth 3 to 8 dB where little is damped (docs/decisions).
#pragma once

#include <optional>
#include <span>

#include "server/reduce/basis.hpp"

namespace palpate {

struct HyperBasisRequest {
  int modes = 13;
  double shift_1_s = 20;   ///< s
  double horizon_s = 0.1;  ///< tau
};

struct HyperBasis {
  Matrix shapes;       ///< V, 3 N x r, orthonormal in M
  Matrix coordinates;  ///< V^T M W, r x candidates: what is expected of the modes; those of indentations are the last
  Projection at_shapes;
  int indentations = 0;
};

/// `start.ports`: P^-1 B a_i, the responses to the port's three input directions, scaled, and that of a sliding load, if any;
/// `prescribed`: how the port itself moves for them (3 N x 3; no columns for touch); `indentations`: where there are any, nothing
/// of second order; `start.fine`: taken beside the leading ones where these do not span it; `snapshots`: where the body was, will
/// be and rests, less where it is. `memory`: warm starts. Nothing when P is not positive definite.
std::optional<HyperBasis> hyper_basis(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve,
                                      const Matrix& prescribed, std::span<const Vector> indentations, const Matrix& snapshots,
                                      const HyperBasisRequest& request, BasisMemory& memory);

}  // namespace palpate
