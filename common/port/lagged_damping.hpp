// What the dampers of a patch's tetrahedra brake more than at the stamp, as a matrix of its variables, for a step that takes them
// at its end.
//
// With H_e how the deformation gradient F_e of a tetrahedron moves with the variables u, and mu_v, lambda_v its viscosities times
// what it counts (sampled_tetrahedra.hpp), its dampers have the power u'^T D_e u',
//     D_e(F) = E^T (2 mu_v 1 + lambda_v tr^T tr) E,   E u' = sym(F^T H_e u'),
// and those of all brake by D1(u) = sum_e D_e(F_e(u)) - D_e(F_e(0)) more. To put that together takes tens of microseconds, so a
// few tetrahedra are asked in each tick, and when all have been, S takes the place of what was known before: D1 as it was some
// milliseconds ago. It serves the step, that is not to be thrown over by what brakes, and not the force: what D1 is beyond S is
// felt too (nonlinear_terms.hpp).
//
// S may brake less than the patch does at the stamp, not by more than kMostTaken of its D: where it would, as weights are those
// of forces and not of dampers, S is sum_e D_e(F_e(u)), which brakes whatever happens.
#pragma once

#include "common/port/sampled_tetrahedra.hpp"

namespace palpate {

class LaggedDamping {
 public:
  using Square = SampledSolidForce::Square;
  using ForVariables = BoundedMatrix<kMaxVariables, kMaxVariables>;
  static constexpr double kMostTaken = 0.9;

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
