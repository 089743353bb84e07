// The other tools of a patch on its modes: contacts that the player closes every step, with tools that go where the patch
// expects them (patch.hpp).
//
// Contact j with port rows R_j pushes with lambda_j in a step as the tool's own does (player.hpp): s_j Psi0 R_j^T lambda_j of the
// step before, (1 - s_j) of this one, and the contact law with C_j = (1 - s_j) R_j Psi0_q R_j^T + c_static,j from the gap
//     gap_j(t) = gap_j* + v_j t' + a_j t'^2 / 2 - slid_j - R_j q,    slid_j: how far its point has slid since the stamp
// where q has what all contacts but j push in this step: those before j as they are, the rest as they were a step ago (one sweep
// of block Gauss-Seidel a step, which converges as the compliance of all contacts together is positive definite). Where a tool
// comes down its point is below it: slid_j takes the tangential part of the gap.
//
// Shapes and units: r modes; R_j 3 x r [kg^-1/2], Psi0 2 r x r; gap, slid 3 [m], v, a [m/s], [m/s^2]; lambda 3 [N]; C 3 x 3
// [m/N]. What can go wrong: the point slides on a plane, and the modes move it as they move the point of the stamp. Source: of
// the sweep, Golub and Van Loan, Matrix Computations (2013), 11.2.
#pragma once

#include <array>
#include <cstdint>

#include "common/player/propagator.hpp"
#include "common/port/contact_law.hpp"
#include "common/port/patch.hpp"

namespace palpate {

/// s: what of a contact's push counts in the step after, where the modes yield by `moved` to a push that lasts a step [m/N].
double share_of_next_step(double coupling_n_m, const Mat3& moved) noexcept;

class OtherContacts {
 public:
  OtherContacts() = default;
  /// `psi0` of a step of `dt_s`. At the stamp.
  OtherContacts(const Patch& patch, const StateInput& psi0, double dt_s);
  bool empty() const { return count_ == 0; }
  /// What the step that comes has of the pushes of the one before: sum s_j Psi0 R_j^T lambda_j.
  void carry_on(StateVector& next) const noexcept;
  /// On to the end of a step. `z`: the state there without what any contact pushes in this step; gets what these do. `own` is
  /// what the tool's own contact adds to q, as it was a step ago.
  void close(StateVector& z, const ModeVector& own) noexcept;
  /// lambda_j, on the body [N].
  const Vec3& push(int j) const { return contacts_[static_cast<std::size_t>(j)].lambda; }

 private:
  struct Contact {
    OtherTool tool;
    Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, kMaxStates, 3> response;  // Psi0 R^T
    double share_next = 0;
    Mat3 compliance = Mat3::Zero();
    bool touching = false;
    Vec3 slid = Vec3::Zero(), lambda = Vec3::Zero();
    ModeVector moved() const { return (1 - share_next) * (response.topRows(tool.rows.cols()) * lambda); }
  };
  void close(Contact& contact, const ModeVector& q) const noexcept;

  int count_ = 0;
  std::array<Contact, kMaxOtherTools> contacts_;
  ContactParameters parameters_;
  double dt_ = 0, moves_for_s_ = 0;
  std::int64_t steps_ = 0;  // since the stamp
};

}  // namespace palpate
