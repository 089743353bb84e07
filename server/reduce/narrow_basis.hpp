// Few modes out of a wide Krylov basis, for what is likely to happen while a patch lasts.
//
// A Krylov basis (basis.hpp) is cut where the modes end: its moments match the response around one slow frequency, and a lightly
// damped body still rings at others. Here more directions W (n of them, M-orthonormal) are solved for than are sent, and the
// small system that they make,
//
//     y'' + D y' + K y = u,     y(0) = 0,     K = W^T K W,  D = W^T D W,
//
// is reduced once more, by an orthogonal projection, so K and D stay symmetric and positive semi-definite where they were. Its
// r directions are, in this order,
//
//   1. W^T M P^-1 B, the port responses at the shift s: there the patch stays as exact as its Krylov basis;
//   2. the leading eigenvectors, in the energy |K|, of the position block of the Gramian of the prediction horizon T,
//          S = 1/T int_0^T (1 - t/T) sum_j y_j(t) y_j(t)^T dt,
//      of the responses y_j to a tool that speeds up along each axis, d = a t^2 / 2 with a T = 20 mm/s, and, at a third of
//      their size, to the free motion y'(0) = W^T M v*, to the residual force u = W^T F* + D y'(0) and to both together.
//
// The weight 1 - t/T is how many of the ages that a patch reaches see the response t after its cause. One Gramian is enough:
// M, D and K are symmetric and the port is collocated, so that of the observer is its mirror image (linear/balance.hpp).
// What was tried instead, and lost, is in docs/notebook/0015-wide-bases.md. Sources: Meyer and Srinivasan, IEEE TAC 41 (1996),
// for balancing positions; Gawronski and Juang, Int. J. Systems Sci. 21 (1990), for Gramians of a limited time.
#pragma once

#include "server/reduce/basis.hpp"

namespace palpate {

struct NarrowRequest {
  int modes = 8;
  double shift_1_s = 20;
  double horizon_s = 0.1;  ///< T
};

/// `wide`: M-orthonormal columns that hold P^-1 B for the `ports` B (3 N each); `residual` F*. M-orthonormal columns, as many as
/// asked or as the wide basis has to give.
Matrix narrowed(const Linearisation& at, const Matrix& wide, const std::vector<Vector>& ports, const Vector& residual,
                const NarrowRequest& request);

}  // namespace palpate
