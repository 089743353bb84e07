// Snapshots (snapshot_set.hpp) from responses of the body to second order, with P = s^2 M + s D + K, s about two over the
// prediction horizon tau:
//
//     P^-1 F*,   s P^-1 M v*     the body's own motion
//     s P^-1 (2 s M + D) x       the next moment of each port response and slide x
//     P^-1 F2(b_i, b_j)          the combined effect of two motions: F2 the second-order forces (nonlinear_elements.hpp),
//                                b of {port responses, slides, tau v*}
//
// The smallest loads, with kNegligibleLoads of the sum of squares, are dropped.
#pragma once

#include "server/reduction/basis.hpp"
#include "server/reduction/snapshot_set.hpp"

namespace palpate {

struct ResponseRequest {
  double shift_1_s = 20;      ///< s
  double horizon_s = 0.1;     ///< tau
  bool second_order = false;  ///< for a body that has_nonlinear_elements()
};

/// Adds responses, from port responses and slides in `to` and from `start`: P^-1 F* and P^-1 M v*. Returns false if P is found
/// not to be positive definite.
bool add_responses(const Linearisation& at, const KrylovStart& start, const KrylovSolve& solve, const ResponseRequest& request,
                   SnapshotSet& to);

}  // namespace palpate
