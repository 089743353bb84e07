// The other contacts of a patch on its modes, which the player closes every step: those of other tools, which follow the paths
// that the patch predicts, and those of other spheres of the tool's own body, which move with it (patch.hpp).
//
// Contact j with port rows R_j pushes with lambda_j in a step like the tool's own (player.hpp): s_j Psi0 R_j^T lambda_j of the
// step before, (1 - s_j) of this one, and the contact law with C_j = (1 - s_j) R_j Psi0_q R_j^T + c_static,j from the gap
//     gap_j(t) = gap_j* + v_j t' + a_j t'^2 / 2 - slid_j - R_j q,    slid_j: displacement of its point by sliding since the stamp
// (d_j in place of v_j t' + a_j t'^2 / 2 for the first `own`, d_j the displacement of the sphere's centre since the stamp),
// where q includes the pushes of all contacts but j in this step: of those before j the new ones, of the rest those of the last
// step (one sweep of block Gauss-Seidel a step, which converges because the compliance of all contacts together is positive
// definite). Where a tool comes down its point is below it: slid_j takes up the tangential part of the gap.
//
// A sphere of the tool's own body whose point is on the patch's piece of surface is a contact there instead, which slides with
// its rows and its normal (surface_contact.hpp), without c_static,j; only where the piece does not reach it is on a plane as
// above.
//
// Shapes and units: r modes; R_j 3 x r [kg^-1/2], Psi0 2 r x r; gap, slid 3 [m], v, a [m/s], [m/s^2]; lambda 3 [N]; C 3 x 3
// [m/N]. What can go wrong: on a plane the modes move the point as they move that of the stamp, wherever it slides. Source: of
// the sweep, Golub and Van Loan, Matrix Computations (2013), 11.2.
#pragma once

#include <array>
#include <cstdint>

#include "common/patch/contact_law.hpp"
#include "common/patch/patch.hpp"
#include "common/player/port_push.hpp"
#include "common/player/surface_contact.hpp"

namespace palpate {

class OtherContacts {
 public:
  OtherContacts() = default;
  /// Starts at the stamp. `psi0`: that of a step of `dt_s`.
  OtherContacts(const Patch& patch, const PlayedSurface& surface, const StateInput& psi0, double dt_s);
  bool empty() const { return count_ == 0; }
  /// Takes the pushes of the tool's own contacts at the stamp, which g has where the surface of the terms moves these, from the
  /// drift of a step, Psi0 g. Where the terms are missing they stay in it.
  void take_from(StateVector& drift) const noexcept;
  /// Adds the pushes of the step before to the coming step: sum s_j Psi0 R_j^T lambda_j.
  void carry_on(StateVector& next) const noexcept;
  /// Closes the contacts at the end of a step, with the tool there. `z`: the state there without any contact's push in this step;
  /// the other tools' pushes are added to it. `own`: contribution of the tool's own contact to q, one step old. Leaves `surface`
  /// placed anywhere.
  void close(StateVector& z, const ModeVector& own, const ToolPose& tool, PlayedSurface& surface) noexcept;
  /// Returns lambda_j, the force on the body [N].
  const Vec3& push(int j) const { return contacts_[static_cast<std::size_t>(j)].push.lambda; }
  /// Adds force [N], torque about the tool point [N m] and grip [N m] on a tool whose other spheres touch. Returns true if any
  /// does.
  bool add_own(const ToolPose& tool, Vec3& force, Vec3& torque, double& grip) const noexcept;

 private:
  struct Contact {
    OtherContact tool;
    ContactParameters law;
    PortPush push;
    bool touching = false;
    bool on_surface = false;
    SurfaceContact surface;    // if on_surface
    Vec3 slid = Vec3::Zero();  // if not
  };
  /// Moves a sphere of the tool's own body to the piece of surface, if that reaches its point at the stamp.
  void find_on(const PlayedSurface& surface, Contact& contact) const;
  void close(Contact& contact, const ModeVector& q, const Vec3& displacement) const noexcept;

  int count_ = 0, own_ = 0;
  ToolPose at_stamp_;
  std::array<Contact, kMaxOtherContacts> contacts_;
  double dt_ = 0, moves_for_s_ = 0;
  std::int64_t steps_ = 0;  // steps since the stamp
};

}  // namespace palpate
