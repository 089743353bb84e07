// The controllability Gramian of a second-order system at its port, P = Z Z^T with Z thin:
//     A P + P A^T + B B^T = 0,    A = [[0, I], [-K, -D]],  B = [B_d; B_k - D B_d]    (mass-scaled: M = I, state_space.hpp)
//
// Low-rank ADI: with W_0 = B and shifts p_i of negative real part, V = (A + p I)^-1 W, the columns of Z are the scaled V, and the
// factor of the Lyapunov residual W W^T becomes W <- (A - conj(p) I) V. Conjugate shifts are applied in pairs, which keeps Z and
// W real. With s = -p and V = [x; w_1 + s x]
//     (s^2 + s D + K) x = -(s + D) w_1 - w_2
// so a shift costs one sparse complex symmetric factorisation.
//
// Shifts: A is projected onto the span of W and the last columns of Z, orthonormal in the energy H = diag(K, I); the next shift
// is the Ritz value that makes W smallest in the projection. In H the damping makes A dissipative, so no Ritz value lies in the
// right half-plane and |W|_H never grows. Sources: Penzl, SIAM J. Sci. Comput. 21 (2000); Benner, Kuerschner and Saak, Numer.
// Algorithms 62 (2013) and ETNA 43 (2014).
#pragma once

#include <utility>
#include <vector>

#include "bench/paper/second_order.hpp"

namespace palpate {

struct BalanceOptions {
  double residual = 1e-12;  ///< tolerance of |W^T H W| / |B^T H B| at which the ADI stops
  int columns_max = 1200;   ///< most columns of Z
};

struct LowRankGramian {
  Matrix displacement, velocity;  ///< Z = [displacement; velocity], mass-scaled, n x columns each
  double residual = 0;            ///< residual that was reached
  int factorisations = 0;
};

/// Shifts and their factorisations, shared by many ports of one body: the ADI of the first port fills it, that of the others
/// reuses them and only solves. With the same shifts Z is linear in B: the factor of a port between two others is the mean of
/// theirs.
using ShiftMemory = std::vector<std::pair<Complex, DynamicStiffness::At>>;

/// Returns the same system in coordinates M^1/2 q, with unit mass.
SecondOrderSystem mass_scaled(const SecondOrderSystem& system);

/// `system` must be mass-scaled. Throws std::runtime_error if the system is not stable (K not positive definite, or growing
/// energy). Stops at columns_max; `residual` is then what was reached. If `memory` is not empty, its shifts are used, and no
/// others.
LowRankGramian low_rank_gramian(const SecondOrderSystem& system, const BalanceOptions& options = {},
                                ShiftMemory* memory = nullptr);

}  // namespace palpate
