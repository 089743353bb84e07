// Balanced truncation of a second-order system at its port, by the square-root method on low-rank Gramians.
//
// With the states of state_space.hpp the strictly proper part (A, B, C) is state-space symmetric: with the signature
// S = [[D, I], [I, 0]] (in mass-scaled coordinates) S A = A^T S and S B = -C^T (up to sign), so the observability Gramian is S P
// S and one Lyapunov equation A P + P A^T + B B^T = 0 is enough. P = Z Z^T with Z thin, from low-rank ADI with complex shifts:
// one sparse factorisation of s^2 M + s D + K a shift, so a solid of thousands of states works like a sheet of hundreds. The
// Hankel singular values are the absolute eigenvalues of Z^T S Z; truncated to `order` states
//     || G - G_r ||_inf <= 2 sum of the values left out                                (error_bound)
// Sources: Moore, IEEE TAC 26 (1981); Penzl, SIAM J. Sci. Comput. 21 (2000); Benner, Kuerschner and Saak, ETNA 43 (2014).
#pragma once

#include "server/linear/state_space.hpp"

namespace palpate {

struct BalanceOptions {
  double residual = 1e-10;  ///< of the Lyapunov equation, relative to |B B^T|: where the ADI stops
  int columns_max = 800;    ///< of Z
};

class BalancedReduction {
 public:
  /// Throws std::runtime_error when the system is not stable or the Gramian does not converge; says how far it got.
  explicit BalancedReduction(const SecondOrderSystem& system, const BalanceOptions& options = {});

  /// Descending [N/m]; as many as the Gramian carries.
  const Vector& hankel() const { return hankel_; }
  /// G_r with `order` states (at most hankel().size()), feed-through included.
  StateSpace truncated(int order) const;
  /// Bound of the H-infinity error of truncated(order) [N/m].
  double error_bound(int order) const;
  /// What each reduced state stands for in the body: 2 n x order, displacements [m] above velocities [m/s].
  Matrix directions(int order) const;
  double residual() const { return residual_; }

 private:
  Vector hankel_;
  Matrix left_, right_;
  StateSpace parts_;
  double residual_ = 0;
};

}  // namespace palpate
