// The change of the damping of a patch's tetrahedra since the stamp, as a lagging matrix of its variables: for a step that treats
// it implicitly.
//
// n variables u (nonlinear_terms.hpp), r modes q among them, the last. With H_e (9 x n) the derivative of the deformation
// gradient F_e of a tetrahedron by u, and mu_v, lambda_v its viscosities times its weight and volume (sampled_tetrahedra.hpp) [J
// s], its dampers have the power u'^T D_e u',
//
//     D_e(F) = E^T (2 mu_v 1 + lambda_v tr^T tr) E,   E u' = sym(F^T H_e u')
//     D1(u) = sum_e D_e(F_e(u)) - D_e(F_e(0))           n x n, N s/m for a tool, 1/s for modes
//     S = D1 of some milliseconds ago,                  or sum_e D_e(F_e(u)) where 0.9 D + S is not positive definite
//     C_S = (1 + C S)^-1 C                              r x r, S of the modes; C as in nonlinear_terms.hpp
//
// Assembling D1 takes tens of microseconds, so each renew() adds up one group of tetrahedra, and after the last group S is
// replaced. It serves the stability of the step, not the force: the difference between D1 and S is felt too
// (nonlinear_terms.hpp).
//
// What can go wrong: the weights are fitted to forces and not to dampers, so the patch with S may have less damping than at the
// stamp; S takes at most 0.9 (kTakenShareMax) of D of the modes away, otherwise the alternative above replaces it. A motion that
// is not finite has S = 0. Source: steps with a derivative that lags, Steihaug and Wolfbrandt, Math. Comp. 33 (1979).
#pragma once

#include "common/patch/sampled_tetrahedra.hpp"

namespace palpate {

class LaggedDamping {
 public:
  using Square = SampledSolidForce::Square;
  using ForVariables = BoundedMatrix<kMaxVariables, kMaxVariables>;
  static constexpr double kTakenShareMax = 0.9;  ///< share of D; below 1, so that some damping remains in every direction

  LaggedDamping() = default;
  /// `solid` stands at u = 0. `damping`: D of the patch's modes, which are the last variables. Allocates.
  LaggedDamping(const SampledSolidForce& solid, const ModeMatrix& damping);

  /// True when nothing is damped.
  bool empty() const { return at_stamp_.size() == 0; }
  /// Adds up the next group of tetrahedra at their current state. `closing`: C, effect of a force on the modes at a step's end.
  /// No allocation.
  void renew(const SampledSolidForce& solid, const ModeMatrix& closing) noexcept;
  /// S
  const ForVariables& change() const { return change_; }
  /// (1 + C S)^-1 C, S that of the modes; size 0 while there is no S.
  const ModeMatrix& closing() const { return closing_; }

 private:
  Square at_stamp_, asked_;
  ForVariables change_;
  ModeMatrix damping_, closing_;
  int next_ = 0;
};

}  // namespace palpate
