// The H-infinity norm, sup over omega of the largest singular value of G(j omega): computed, not sampled.
//
// For a small system: gamma is a singular value of G(j omega) iff j omega is an eigenvalue of the Hamiltonian matrix of (A, B, C,
// D0, gamma); the level set is bisected with the midpoints of its intervals (Bruinsma and Steinbuch, Systems & Control Letters 14
// (1990); Boyd and Balakrishnan (1990)), which converges quadratically. D1 must be zero: the norm of an improper system is
// infinite.
#pragma once

#include <functional>

#include "server/linear/state_space.hpp"

namespace palpate {

struct PeakGain {
  double norm = 0;         ///< largest singular value
  double omega_rad_s = 0;  ///< where; 0 for DC, infinity for the feed-through
};

/// Within `tolerance` (relative) of the norm. Throws std::runtime_error when A is not stable.
PeakGain hinf_norm(const StateSpace& system, double tolerance = 1e-7);

/// `a` minus `b`, as one system of a.states() + b.states() states.
StateSpace difference(const StateSpace& a, const StateSpace& b);

/// The largest singular value over `points` logarithmic samples from `from` to `to` [rad/s] and at 0, the highest ones refined by
/// golden section: a lower bound of the norm, for systems of any size and as a check of hinf_norm().
PeakGain sampled_peak(const std::function<ComplexMatrix(Complex)>& transfer, double from_rad_s, double to_rad_s, int points);

}  // namespace palpate
