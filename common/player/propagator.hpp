// One step of the linear model, exactly.
//
//     (1 + A) q'' + D q' + K q = w(t),   w(t) = w0 + w1 t / dt   inside the step
//     z(dt) = Phi z(0) + Psi0 w0 + Psi1 w1,              z = (q, q')
//
// Phi, Psi0 and Psi1 are blocks of one matrix exponential: with M = (1 + A)^-1, w and its growth per step as further states, and
// velocities in q per step, it is exp of
//
//     [   0         1        0       0 ]
//     [ -dt^2 M K  -dt M D   dt^2 M  0 ]     4 r x 4 r
//     [   0         0        0       1 ]
//     [   0         0        0       0 ]
//
// Shapes and units: r modes; K = diag(stiffness) [1/s^2], D, A r x r [1/s, 1], w [kg^1/2 m/s^2], q [m kg^1/2]; Phi 2 r x 2 r,
// Psi0 and Psi1 2 r x r, [s^2] in their upper and [s] in their lower rows.
//
// What can go wrong: there is no time-stepping error, but the exponential is by scaling and squaring, which loses digits as (dt
// omega)^2 and dt |D| grow; forces that are not linear in t inside a step are treated as linear.
//
// Source: Van Loan, IEEE TAC 23 (1978); Higham, SIAM J. Matrix Anal. Appl. 26 (2005), for the exponential.
#pragma once

#include "common/patch/patch.hpp"

namespace palpate {

inline constexpr int kMaxStates = 2 * kMaxModes;  ///< size of z: q and q'
using StateVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxStates, 1>;
using StateMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxStates, kMaxStates>;
using StateInput = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxStates, kMaxModes>;

struct Propagator {
  StateMatrix phi;
  StateInput psi0, psi1;
};

/// Computes the propagator. `added_mass`: A, size 0 for none. Allocates; for the network side of the hand-over, not for the tick.
Propagator make_propagator(const ModeVector& stiffness, const ModeMatrix& damping, const ModeMatrix& added_mass, double dt_s);

}  // namespace palpate
