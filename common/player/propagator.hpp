// One step of the linear model, exactly.
//
//     (1 + A) q'' + D q' + K q = w(t),   w(t) = w0 + w1 t / dt   inside the step
//     z(dt) = Phi z(0) + Psi0 w0 + Psi1 w1,              z = (q, q')
//
// Phi (2r x 2r), Psi0 and Psi1 (2r x r) are blocks of one matrix exponential (Van Loan, IEEE TAC 23 (1978)): no time-stepping
// error.
#pragma once

#include "common/port/patch.hpp"

namespace palpate {

inline constexpr int kMaxStates = 2 * kMaxModes;
using StateVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxStates, 1>;
using StateMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxStates, kMaxStates>;
using StateInput = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxStates, kMaxModes>;

struct Propagator {
  StateMatrix phi;
  StateInput psi0, psi1;
};

/// Allocates; for the network side of the hand-over, not for the tick.
/// `added_mass`: A, of no size for none.
Propagator make_propagator(const ModeVector& stiffness, const ModeMatrix& damping, const ModeMatrix& added_mass, double dt_s);

}  // namespace palpate
