// Converts a pointer over the picture to a position for the tool: touching a body with a mouse.
//
// Touch scenes: the tool hovers kHover of the body's size above the point of the resting body under the pointer, along its
// normal. While the button is held it is at the press depth below that point, so dragging strokes and the wheel presses deeper.
// The resting body is used on purpose: a target that followed its own indentation would sink by itself. A pointer that jumps
// would lead the tool straight through the body: the tool follows along the picture at kWalk, over the visible surface, higher
// the farther it has to go, and presses on arrival. Off the body the tool moves in the plane of the picture. Attach scenes: the
// button grasps the node, and the tool moves with the pointer in the plane of the picture through it; when released, it returns
// home.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "client/view/camera.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

/// Position of the pointer in pixels from the top left, in a picture of this size.
struct Pointer {
  float x = 0, y = 0, width = 1, height = 1;
  bool held = false;
};

struct RayHit {
  Vec3f point, normal;
};
/// Returns the first point of the surface along a ray; `normal` is that of its triangle, towards the outside.
std::optional<RayHit> first_hit(std::span<const Triangle> triangles, std::span<const Vec3f> positions, const Vec3f& from,
                                const Vec3f& direction);

class PointerTool {
 public:
  /// `rest` outlives the tool.
  PointerTool(std::span<const Triangle> triangles, std::span<const Vec3f> rest, ContactKind contact, const Vec3& home);

  /// Returns the target of the tool, `elapsed` after the last call.
  Vec3 target(const Camera& camera, const Pointer& pointer, Micros elapsed);
  /// Deepens the press by turns of the wheel.
  void deepen(float steps);
  float depth_m() const { return depth_m_; }

  static constexpr float kWalk = 2;  ///< heights of the picture per second

 private:
  Vec3f press(const Camera& camera, const Pointer& pointer, Micros elapsed);
  Pointer walk(const Camera& camera, const Pointer& pointer, Micros elapsed);
  Vec3f pull(const Camera& camera, const Pointer& pointer);
  Vec3f smooth_normal(const Vec3f& point, const Vec3f& flat) const;

  std::span<const Triangle> triangles_;
  std::span<const Vec3f> rest_;
  std::vector<Vec3f> normals_;
  ContactKind contact_;
  Vec3f home_, point_, normal_;  ///< the tool is above or below the point, along the normal
  float lift_ = 0;               ///< added to kHover while the tool has far to go, relative to the body's size
  bool pressing_ = false;
  float size_, depth_m_;
  std::optional<Vec3f> taken_;  ///< intersection of pointer and plane when the node was grasped
};

}  // namespace palpate
