// Balanced truncation of a second-order system at its port, by the square-root method on a low-rank Gramian.
//
// With the states of state_space.hpp the strictly proper part (A, B, C) is symmetric in the signature (mass-scaled: M = I)
//     S = [[D, I], [I, 0]]:     S A = [[-K, 0], [0, I]] = A^T S,     S B = [B_k; B_d] = -C^T,
// because M, D and K are symmetric and the port is collocated. So the observability Gramian is Q = S P S and one Lyapunov
// equation, A P + P A^T + B B^T = 0, is enough. With P = Z Z^T (low_rank_gramian.hpp) and the eigenvalues
//     Z^T S Z = U diag(lambda) U^T,       hankel_i = |lambda_i|,  sigma_i = sign(lambda_i),
// the balancing transformation and its inverse are
//     T = Z U diag(hankel)^-1/2,          T^-1 = diag(sigma) T^T S,
// and the balanced system is again symmetric, now in the signature diag(sigma). Truncated to `order` states
//     || G - G_r ||_inf <= 2 sum of the Hankel values left out.
// Hankel values below the error from rounding (n eps times the sum of absolute terms) or from the Gramian's residual (times the
// largest) are dropped from the balanced system: their states are noise, which 1 / hankel would amplify. Sources: Moore, IEEE TAC
// 26 (1981); Tombs and Postlethwaite, Int. J. Control 46 (1987); for symmetric systems Fernando and Nicholson, IEEE TAC 28
// (1983).
#pragma once

#include "bench/paper/low_rank_gramian.hpp"
#include "bench/paper/state_space.hpp"

namespace palpate {

class BalancedReduction {
 public:
  /// Throws std::runtime_error if the system is not stable or the Gramian does not converge, with the residual that was reached.
  explicit BalancedReduction(const SecondOrderSystem& system, const BalanceOptions& options = {});

  /// Hankel values, descending [N/m]; those above rounding.
  const Vector& hankel() const { return hankel_; }
  int states() const { return static_cast<int>(hankel_.size()); }
  /// Returns G_r with `order` states, 0 <= order <= states(), feed-through included.
  StateSpace truncated(int order) const;
  /// Returns the first order from `from` on whose truncation is stable. One that separates two equal Hankel values, or lies among
  /// those below the Gramian's residual, may not be.
  int stable_order(int from) const;
  /// Returns a bound of the H-infinity error of truncated(order) [N/m]: twice the sum of the values left out, where those below
  /// the error floor count as equal to it.
  double error_bound(int order) const;
  /// Returns the first `order` columns of T, the shape of each balanced state in the body: 2 n x order, displacements [m] of the
  /// free coordinates above velocities [m/s] (while the port stands at 0).
  Matrix directions(int order) const { return directions_.leftCols(order); }
  /// Residual of the Lyapunov equation, |W^T H W| / |B^T H B|.
  double residual() const { return residual_; }
  /// Number of columns of Z.
  int columns() const { return columns_; }
  int factorisations() const { return factorisations_; }

 private:
  Vector hankel_;
  Matrix directions_;
  StateSpace balanced_;
  double residual_ = 0, floor_ = 0;
  int columns_ = 0, factorisations_ = 0;
};

}  // namespace palpate
