// The state in which a body hangs still: F(x, 0) = 0 on the nodes that are not fixed.
//
// Found by pseudo-transient continuation: steps
//     (M / h^2 + K) dx = F(x, 0),      K = -dF/dx, its negative eigenvalues clamped where the matrix is not positive definite
// along which the potential energy U (elastic and gravity's) has to fall; a step that does not is halved. Near the end U tells
// nothing any more: it is a sum of terms of the size S = l^2 tr K / 3, l the mean edge, each rounded. Where a step gains less
// than that what is out of balance has to fall instead. h begins at kFirstS and grows by kGrowth with every step that is taken
// whole, so that the last steps are Newton's, and shrinks where one was cut. The path is that of a body which sinks through
// honey: of several equilibria it finds one that is stable. A body whose stress fades (relaxation.hpp) has hung for ever: it is
// found with what is left of its materials.
//
// Source: Kelley and Keyes, Convergence analysis of pseudo-transient continuation, SIAM J. Numer. Anal. 35 (1998).
#pragma once

#include <string>

#include "server/body/dynamics.hpp"

namespace palpate {

struct Equilibrium {
  BodyState state;        ///< at time 0, at rest
  double residual_n = 0;  ///< the largest force out of balance on a node that is not fixed [N]
  double load_n = 0;      ///< all that is out of balance at the start: gravity, at rest [N]
  int iterations = 0;
  bool found = false;  ///< residual_n <= kBalanced load_n, or what rounding leaves of forces
};

inline constexpr double kBalanced = 1e-9;

/// From the rest shape, which it is itself when nothing pulls (no gravity).
Equilibrium find_equilibrium(const Dynamics& dynamics);
/// From a state whose fixed nodes may be elsewhere than at rest.
Equilibrium find_equilibrium(const Dynamics& dynamics, const BodyState& from);

/// Its state. Throws InputError that names body.gravity_m_s2 of `scene` (its name) when it is not found.
BodyState settled_state(const Dynamics& dynamics, const std::string& scene);

}  // namespace palpate
