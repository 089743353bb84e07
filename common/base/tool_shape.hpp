// The body of a tool: up to kMaxToolSpheres spheres that move with its frame T (tool_pose.hpp). A tool without any is the point
// at T's origin. Spheres of a jaw also turn about its hinge, a line along T's y axis; the point where the two blades of scissors
// cross slides along T's z axis:
//
//     c_j = h + R a_j(o)                                centre of sphere j
//     a_j(o) = p + Ry(-o s_j) (a_j - p),  p = (0, 0, z_j);   or  a_j + o d_j e_z  where it slides
//
// Symbols: h [m] position of the tool point, R = R_WT its rotation, a_j [m] the centre in T with closed jaws, o the opening, from
// 0 closed to 1 wide open; z_j [m] the hinge, s_j [rad] the angle by which the jaw of sphere j has turned when wide open,
// positive where it opens to +x, 0 for a sphere of no jaw; d_j [m] the way that it has slid then, 0 for a sphere that
// does not slide; r_j [m] the radius.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "common/base/rotation_vector.hpp"
#include "common/base/types.hpp"

namespace palpate {

struct ToolSphere {
  Vec3 centre = Vec3::Zero();  ///< a_j, in T [m]
  double radius_m = 0;         ///< r_j
  double hinge_m = 0;          ///< z_j
  double swing_rad = 0;        ///< s_j
  double slide_m = 0;          ///< d_j; 0 on a jaw
  bool operator==(const ToolSphere&) const = default;
  bool on_jaw() const { return swing_rad != 0; }
  /// Returns true if it moves with the opening.
  bool opens() const { return on_jaw() || slide_m != 0; }
  /// a_j(o).
  Vec3 centre_at(double opening) const;
  /// d a_j / d o [m].
  Vec3 swept(double opening) const;
};

inline constexpr std::size_t kMaxToolSpheres = 8;
inline constexpr double kMaxToolReachM = 0.249;  ///< of |a_j| along each axis, of |z_j|, |d_j| and r_j
inline constexpr double kMaxSwingRad = 1.1;      ///< of |s_j|
/// Lengths and angles are whole steps, so that the sender of a patch and its receiver have the same.
inline constexpr double kToolStepM = 0x1p-17, kSwingStepRad = 0x1p-14;

using ToolShape = std::vector<ToolSphere>;

/// One of a scene's further tools, which a hand asks for by name.
struct HeldTool {
  std::string name;  ///< empty: the scene's first tool, and no `shape`
  ToolShape shape;   ///< empty: a point
  bool operator==(const HeldTool&) const = default;
};

inline bool has_jaws(const ToolShape& shape) { return std::ranges::any_of(shape, &ToolSphere::opens); }

struct ToolPose {
  Vec3 position = Vec3::Zero();  ///< h
  Rotation turn = Rotation::Identity();
  double opening = 0;  ///< o
  ToolPose() = default;
  ToolPose(const Vec3& at) : position(at) {}  // NOLINT: a tool that is held upright
  ToolPose(const Vec3& at, const Rotation& how, double open = 0) : position(at), turn(how), opening(open) {}
  /// Upright where the device has no orientation.
  explicit ToolPose(const ToolSample& sample)
      : position(sample.position), turn(sample.orientation.value_or(Rotation::Identity())), opening(sample.opening) {}
  /// Returns R a_j(o).
  Vec3 arm_of(const ToolSphere& sphere) const { return turn * sphere.centre_at(opening); }
  Vec3 centre_of(const ToolSphere& sphere) const { return position + arm_of(sphere); }
};

/// Returns the pose at the share `s` of the way from one to the other, with constant velocity and spin.
inline ToolPose pose_between(const ToolPose& from, const ToolPose& to, double s) {
  return {from.position + s * (to.position - from.position), interpolate(from.turn, to.turn, s),
          from.opening + s * (to.opening - from.opening)};
}

/// Returns the part of a contact in the generalised force on the opening [N m]: its power is that times o'. `force` on the tool
/// [N] acts at `arm` from the tool point, on a sphere of the tool turned by `turn`; positive: it opens the jaws.
double grip_of(const ToolSphere& sphere, const Rotation& turn, const Vec3& arm, const Vec3& force);

}  // namespace palpate
