// The body of a tool: up to kMaxToolSpheres spheres that move with its frame T (tool_pose.hpp). A tool without any is the point
// at T's origin.
//
//     c_j = h + R a_j       centre of sphere j
//
// Symbols: h [m] position of the tool point, R = R_WT its rotation, a_j [m] the centre in T; r_j [m] the radius.
#pragma once

#include <vector>

#include "common/base/rotation_vector.hpp"
#include "common/base/types.hpp"

namespace palpate {

struct ToolSphere {
  Vec3 centre = Vec3::Zero();  ///< a_j, in T [m]
  double radius_m = 0;         ///< r_j
  bool operator==(const ToolSphere&) const = default;
};

inline constexpr std::size_t kMaxToolSpheres = 8;
inline constexpr double kMaxToolReachM = 0.249;  ///< of |a_j| along each axis, and of r_j
/// Centres and radii are whole steps, so that the sender of a patch and its receiver have the same.
inline constexpr double kToolStepM = 0x1p-17;

using ToolShape = std::vector<ToolSphere>;

struct ToolPose {
  Vec3 position = Vec3::Zero();  ///< h
  Rotation turn = Rotation::Identity();
  ToolPose() = default;
  ToolPose(const Vec3& at) : position(at) {}  // NOLINT: a tool that is held upright
  ToolPose(const Vec3& at, const Rotation& how) : position(at), turn(how) {}
  /// Upright where the device has no orientation.
  explicit ToolPose(const ToolSample& sample)
      : position(sample.position), turn(sample.orientation.value_or(Rotation::Identity())) {}
  Vec3 centre_of(const ToolSphere& sphere) const { return position + turn * sphere.centre; }
};

/// Returns the pose at the share `s` of the way from one to the other, with constant velocity and spin.
inline ToolPose pose_between(const ToolPose& from, const ToolPose& to, double s) {
  return {from.position + s * (to.position - from.position), interpolate(from.turn, to.turn, s)};
}

}  // namespace palpate
