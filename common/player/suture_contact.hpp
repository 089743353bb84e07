// The thread of a patch, which the hand holds by its end, on the patch's modes; the player closes it every step by the law of the
// server (common/patch/suture.hpp).
//
// With R_j the port rows of bite j and u_i the direction of span i, a tension T_i pulls the modes with T_i phi_i, phi_i =
// (R_(i-1) - R_i)^T u_i (of the last span R_(n-1)^T u_n), and the span shortens by phi_i . q. In a step the pull counts like that
// of a contact (player.hpp): s Psi0 sum_i T_i phi_i of the step before, (1 - s) of this one. So with the distances l_i(h) without
// it at the end of the step
//
//     T = f(l - A T),   A_im = (1 - s) phi_i . Psi0_q phi_m
//
// f the tensions at these distances, and from the lengths at the begin of the step. Newton's method with f' of a slide solves it,
// kMostIterations at most. Bites that bear more than J d then move on through the tissue, and keep their rows; what a tick has no
// time for is for the next. s = 1 / (2 k tr A
// / (1 - s)), 1/2 at most, at the stamp.
//
// Shapes and units: r modes, n bites, spans i = 1 ... n; R 3 x r [kg^-1/2], Psi0 2 r x r; phi r; T [N], l [m], A [m/N], k [N/m].
// What can go wrong: within a step spans keep their directions.
#pragma once

#include "common/patch/patch.hpp"
#include "common/player/propagator.hpp"

namespace palpate {

class SutureContact {
 public:
  SutureContact() = default;
  /// Starts at the stamp. `psi0`: that of a step.
  SutureContact(const Patch& patch, const StateInput& psi0);
  bool empty() const { return suture_.empty(); }
  /// Adds the pull of the step before to the coming step.
  void carry_on(StateVector& next) const noexcept;
  /// Closes the spans at the end of a step, with the hand there. `z`: the state there without the pull in this step, which is
  /// added to it.
  void close(StateVector& z, const Vec3& hand) noexcept;
  /// Returns the force on the hand [N].
  const Vec3& force() const { return force_; }
  /// Material lengths of the spans [m].
  const OfSpans& lengths() const { return suture_.length_m; }

 private:
  static constexpr int kMostIterations = 12;
  static constexpr int kSettledInATick = 12;  ///< of a thread that cuts: 0.7 us each with eight bites, three to six in the mean
  using OfStates = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxStates, 1>;
  SuturePlace place_at(const ModeVector& q, const Vec3& hand) const noexcept;
  SutureShape shape_at(const ModeVector& q, const Vec3& hand) const noexcept;
  /// Sets phi and Psi0 phi of all spans.
  void point(const SutureShape& shape) noexcept;

  PatchSuture suture_;
  std::array<Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, kMaxStates, 3>, kMaxBites> response_;  // Psi0 R_j^T
  std::array<ModeVector, kMaxSpans> phi_;
  std::array<OfStates, kMaxSpans> moved_;  // Psi0 phi_i
  OfSpans tension_n_{};
  OfStates pull_;  // Psi0 sum_i T_i phi_i
  double share_next_ = 0;
  Vec3 force_ = Vec3::Zero();
};

}  // namespace palpate
