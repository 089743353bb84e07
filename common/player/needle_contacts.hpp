// The contacts of a needle on the modes of a patch, which the player closes every step: of its tip and of its shaft, on the path
// of the patch (common/patch/needle.hpp).
//
// Contact j with rows R_j pushes with lambda_j in a step like the tool's own on a surface (player.hpp): s_j Psi0 R_j^T lambda_j
// of the step before, (1 - s_j) of this one, closed with C_j = (1 - s_j) R_j Psi0_q R_j^T. They are closed one after the other,
// the tip last, each with the newest pushes of the others (one sweep of block Gauss-Seidel a step). The tip is closed again where
// it has moved to, kSlidesMax times at most.
//
// Shapes and units: those of other_contacts.hpp. What can go wrong: between the points of the path the body is taken to move
// linearly.
#pragma once

#include <array>

#include "common/patch/needle.hpp"
#include "common/patch/patch.hpp"
#include "common/player/port_push.hpp"

namespace palpate {

class NeedleContacts {
 public:
  NeedleContacts() = default;
  /// Starts at the stamp. `psi0`: that of a step.
  NeedleContacts(const Patch& patch, const StateInput& psi0);
  bool empty() const { return needle_.empty(); }
  /// Returns true while the tip is in the body.
  bool inside() const { return needle_.tip.inside; }
  const NeedleTip& tip() const { return needle_.tip; }
  /// Returns true if a push of a tool that touches the surface, held as `tool`, punctures it.
  bool punctures(const Vec3& push, const ToolPose& tool) const noexcept;
  /// Begins a path at `entry`, where the surface is now. `z`: the modes there.
  void enter(const StateVector& z, const Vec3& entry) noexcept;
  /// Adds the pushes of the step before to the coming step.
  void carry_on(StateVector& next) const noexcept;
  /// Closes the contacts at the end of a step, with the tip there. `z`: the state there without their pushes in this step, which
  /// are added to it.
  void close(StateVector& z, const ToolPose& tip) noexcept;
  /// Returns the contribution to q of the pushes of the last step.
  ModeVector moved() const noexcept;
  /// Adds force [N] and torque about the tip [N m] on the tool.
  void add(Vec3& force, Vec3& torque) const noexcept;

 private:
  struct ShaftContact {
    PortPush push;
    bool bonded = false;      // whether the shaft has reached the point
    Vec3 arm = Vec3::Zero();  // from the tip, where it pushes
  };
  void place_tip() noexcept;
  Vec3 at_depth(double depth_m, const ModeVector& q, Vec3& tau) const noexcept;
  void close_shaft(int j, const ModeVector& q, const ToolPose& tool, const Vec3& axis) noexcept;
  void close_tip(const ModeVector& q, const ToolPose& tool) noexcept;

  PatchNeedle needle_;
  double contact_stiffness_n_m_ = 0;
  std::array<ShaftContact, kNeedlePoints> shaft_;
  PortRows tip_rows_;
  PortPush tip_;
};

}  // namespace palpate
