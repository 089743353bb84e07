// The controllability Gramian of a second-order system at its port, P = Z Z^T with Z thin:
//     A P + P A^T + B B^T = 0,    A = [[0, I], [-K, -D]],  B = [B_d; B_k - D B_d]    (mass-scaled: M = I, state_space.hpp)
//
// Low-rank ADI: with W_0 = B and shifts p_i of negative real part, V = (A + p I)^-1 W, columns of Z are the scaled V, and
// W <- (A - conj(p) I) V is what the Lyapunov equation still lacks: its residual is W W^T. Conjugate shifts are taken as a pair,
// which keeps Z and W real. With s = -p and V = [x; w_1 + s x]
//     (s^2 + s D + K) x = -(s + D) w_1 - w_2
// so a shift costs one sparse complex symmetric factorisation.
//
// Shifts: A is projected onto the span of W and the last columns of Z, orthonormal in the energy H = diag(K, I); of the Ritz
// values the one is taken that makes W smallest in the projection. In H the damping makes A dissipative, so no Ritz value lies
// in the right half-plane and |W|_H never grows. Sources: Penzl, SIAM J. Sci. Comput. 21 (2000); Benner, Kuerschner and Saak,
// Numer. Algorithms 62 (2013) and ETNA 43 (2014).
#pragma once

#include <utility>
#include <vector>

#include "server/linear/second_order.hpp"

namespace palpate {

struct BalanceOptions {
  double residual = 1e-12;  ///< |W^T H W| / |B^T H B|: where the ADI stops
  int columns_max = 1200;   ///< of Z
};

struct LowRankGramian {
  Matrix displacement, velocity;  ///< Z = [displacement; velocity], mass-scaled, n x columns each
  double residual = 0;            ///< reached
  int factorisations = 0;
};

/// Shifts and their factorisations, for many ports of one body: the ADI of the first port fills it, the others go the same way,
/// solves only. With the same shifts Z is linear in B: the factor of a port between two others is the mean of theirs.
using ShiftMemory = std::vector<std::pair<Complex, DynamicStiffness::At>>;

/// The same system in coordinates M^1/2 q: mass 1.
SecondOrderSystem mass_scaled(const SecondOrderSystem& system);

/// `system` must be mass-scaled. Throws std::runtime_error when the system is not stable (K not positive definite, or energy that
/// grows); stops at columns_max, and `residual` says how far it got. With a `memory` that is not empty its shifts are taken, and
/// no others.
LowRankGramian low_rank_gramian(const SecondOrderSystem& system, const BalanceOptions& options = {},
                                ShiftMemory* memory = nullptr);

}  // namespace palpate
