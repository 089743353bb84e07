// The H-infinity norm, sup over omega of the largest singular value of G(j omega), computed rather than sampled.
//
// gamma > |D0| is a singular value of G(j omega) iff j omega is an eigenvalue of the Hamiltonian matrix
//     [ A + B R^-1 D0^T C               B R^-1 B^T          ]
//     [ -C^T (I + D0 R^-1 D0^T) C      -(A + B R^-1 D0^T C)^T ],     R = gamma^2 I - D0^T D0.
// From a lower bound (DC, feed-through, the frequencies of the poles) gamma is raised by the tolerance; the eigenvalues on the
// axis bound the intervals where G exceeds gamma, and the largest gain at their midpoints is the next lower bound. This converges
// quadratically; it ends when no eigenvalue is left on the axis. D1 must be zero: the norm of an improper system is infinite.
// Sources: Boyd and Balakrishnan, Systems & Control Letters 15 (1990); Bruinsma and Steinbuch, ibid. 14 (1990).
#pragma once

#include <functional>

#include "bench/paper/balance.hpp"

namespace palpate {

/// Returns the largest singular value; 0 for an empty matrix.
double largest_singular_value(const ComplexMatrix& m);

struct PeakGain {
  double norm = 0;         ///< largest singular value
  double omega_rad_s = 0;  ///< frequency of the peak; 0 for DC, infinity for the feed-through
};

/// Returns the norm within `tolerance` (relative). Dense: 8 N^3 per step, so N of some hundreds at most.
/// Throws std::runtime_error if A is not stable or D1 is not zero.
PeakGain hinf_norm(const StateSpace& system, double tolerance = 1e-7);

/// Returns `a` minus `b`, as one system of a.states() + b.states() states.
StateSpace difference(const StateSpace& a, const StateSpace& b);

/// Returns G(s) - s D1, the bounded part, to which errors are relative.
StateSpace proper(StateSpace system);

/// Returns the largest singular value over `points` logarithmic samples from `from_rad_s` to `to_rad_s` and at 0, with the
/// highest one refined by golden section: a lower bound of the norm, for systems of any size and as a check of hinf_norm().
PeakGain sampled_peak(const std::function<ComplexMatrix(Complex)>& transfer, double from_rad_s, double to_rad_s, int points);

/// Error of a reduction relative to the full system.
struct ReductionError {
  PeakGain peak;           ///< of G_high - reduced [N/m]
  double uncertainty = 0;  ///< the true norm lies within peak.norm +- this [N/m]
  double relative = 0;     ///< peak.norm over the norm of the proper part of G
};

/// Returns || G - reduced ||_inf of the system that was balanced, for any reduction of it with the same D1 (truncated(), or the
/// state space of a projection). The Hamiltonian of the full error system is too large (524 states: a dense eigenproblem of size
/// 1068, half a minute per step), so G is replaced by the balanced model of such a high order that its own error bound is a
/// thousandth of the result (or by all its states): that bound is the uncertainty.
ReductionError reduction_error(const BalancedReduction& balanced, const StateSpace& reduced);

}  // namespace palpate
