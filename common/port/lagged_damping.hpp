// What the dampers of a patch's tetrahedra brake more than at the stamp, as a matrix of its variables that lags: for a step that
// takes them at its end.
//
// n variables u (nonlinear_terms.hpp), r modes q among them, the last. With H_e (9 x n) how the deformation gradient F_e of a
// tetrahedron moves with u, and mu_v, lambda_v its viscosities times what it counts (sampled_tetrahedra.hpp) [J s], its dampers
// have the power u'^T D_e u',
//
//     D_e(F) = E^T (2 mu_v 1 + lambda_v tr^T tr) E,   E u' = sym(F^T H_e u')
//     D1(u) = sum_e D_e(F_e(u)) - D_e(F_e(0))           n x n, N s/m for a tool, 1/s for modes
//     S = D1 of some milliseconds ago,                  or sum_e D_e(F_e(u)) where 0.9 D + S is not positive definite
//     C_S = (1 + C S)^-1 C                              r x r, S of the modes; C as in nonlinear_terms.hpp
//
// To put D1 together takes tens of microseconds, so one group of tetrahedra is added up in each renew(), and when all have been,
// S is replaced. It serves the stability of the step, and not the force: what D1 is beyond S is felt too
// (nonlinear_terms.hpp).
//
// What can go wrong: weights are those of forces and not of dampers, so S may brake less than the patch does at the stamp; not by
// more than 0.9 (kTakenShareMax) of D of the modes, or S is what brakes whatever happens. A motion that is not finite has S = 0.
// Source: steps with a derivative that lags, Steihaug and Wolfbrandt, Math. Comp. 33 (1979).
#pragma once

#include "common/port/sampled_tetrahedra.hpp"

namespace palpate {

class LaggedDamping {
 public:
  using Square = SampledSolidForce::Square;
  using ForVariables = BoundedMatrix<kMaxVariables, kMaxVariables>;
  static constexpr double kTakenShareMax = 0.9;  ///< of D; short of 1, so that something brakes in every direction

  LaggedDamping() = default;
  /// `solid` stands at u = 0. `damping`: D of the patch's modes, which are the last variables. Allocates.
  LaggedDamping(const SampledSolidForce& solid, const ModeMatrix& damping);

  /// Nothing is damped.
  bool empty() const { return at_stamp_.size() == 0; }
  /// Asks the next tetrahedra, where they are. `closing`: C, what a force on the modes gives them at a step's end. No allocation.
  void renew(const SampledSolidForce& solid, const ModeMatrix& closing) noexcept;
  /// S
  const ForVariables& change() const { return change_; }
  /// (1 + C S)^-1 C, S that of the modes; of no size where S is nothing yet.
  const ModeMatrix& closing() const { return closing_; }

 private:
  Square at_stamp_, asked_;
  ForVariables change_;
  ModeMatrix damping_, closing_;
  int next_ = 0;
};

}  // namespace palpate
