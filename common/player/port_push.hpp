// A push on the body at a port of a patch, on its modes, as the player applies it in steps (player.hpp): it counts by 1 - s in
// its step and by s in the next one,
//
//     z += (1 - s) Psi0 R^T lambda,      z_next += s Psi0 R^T lambda,      C = (1 - s) R Psi0_q R^T + c_static
//
// with z the state of the modes, Psi0 the effect of a constant load during a step (propagator.hpp), Psi0_q its first r rows.
//
// Shapes and units: r modes; R 3 x r [kg^-1/2], Psi0 2 r x r; lambda 3 [N]; C, c_static 3 x 3 [m/N]; 0 <= s <= 1/2.
#pragma once

#include "common/patch/patch.hpp"
#include "common/player/propagator.hpp"

namespace palpate {

/// s: share of a contact's push that counts in the next step, where the modes yield by `moved` to a push that lasts a step [m/N].
double share_of_next_step(double contact_stiffness_n_m, const Mat3& moved) noexcept;

struct PortPush {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, kMaxStates, 3> response;  ///< Psi0 R^T
  double share_next = 0;                                                              ///< s
  Mat3 compliance = Mat3::Zero();                                                     ///< C
  Vec3 lambda = Vec3::Zero();

  /// Sets s and C from `response` and R = `rows`.
  void set_compliance(const PortRows& rows, double contact_stiffness_n_m, const Mat3& c_static = Mat3::Zero()) noexcept;
  /// Returns the contribution to q of the push in its step.
  ModeVector moved() const noexcept;
  /// Adds the push to its step and to the next one.
  void add_to(StateVector& z) const noexcept;
  void carry_on(StateVector& next) const noexcept;
};

}  // namespace palpate
