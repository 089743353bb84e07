// From a pointer over the picture to a place for the tool: how a mouse touches a body.
//
// Touch scenes: the tool hovers kHover of the body's size above the point of the resting body under the pointer, along its
// normal; with the button held it goes the press depth below that point, so dragging strokes and the wheel presses deeper. The
// resting body is used on purpose: a target that followed the pit it makes would sink by itself. A pointer that jumps would lead
// the tool straight through the body: it is followed along the picture at kWalk, so the tool goes over what is in sight, higher
// the farther it has to go, and presses once it is there. Beside the body the tool goes along in the plane of the picture. Attach
// scenes: the button takes the node, and the tool moves with the pointer in the plane of the picture through it; let go, it
// returns home.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "client/view/camera.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

/// Pointer in pixels from the top left, in a picture of this size.
struct Pointer {
  float x = 0, y = 0, width = 1, height = 1;
  bool held = false;
};

struct RayHit {
  Vec3f point, normal;
};
/// First point of the surface along a ray; `normal` is that of its triangle, towards the outside.
std::optional<RayHit> first_hit(std::span<const Triangle> triangles, std::span<const Vec3f> positions, const Vec3f& from,
                                const Vec3f& direction);

class PointerTool {
 public:
  /// `rest` outlives the tool.
  PointerTool(std::span<const Triangle> triangles, std::span<const Vec3f> rest, ContactKind contact, const Vec3& home);

  /// Where the tool should be, `elapsed` after the last call.
  Vec3 target(const Camera& camera, const Pointer& pointer, Micros elapsed);
  /// Deeper by so many turns of the wheel.
  void deepen(float steps);
  float depth_m() const { return depth_m_; }

  static constexpr float kWalk = 2;  ///< heights of the picture a second

 private:
  Vec3f press(const Camera& camera, const Pointer& pointer, Micros elapsed);
  Pointer walk(const Camera& camera, const Pointer& pointer, Micros elapsed);
  Vec3f pull(const Camera& camera, const Pointer& pointer);
  Vec3f smooth_normal(const Vec3f& point, const Vec3f& flat) const;

  std::span<const Triangle> triangles_;
  std::span<const Vec3f> rest_;
  std::vector<Vec3f> normals_;
  ContactKind contact_;
  Vec3f home_, point_, normal_;  ///< the tool is over or under the point, along the normal
  float lift_ = 0;               ///< beside kHover, while it has far to go, of the body's size
  bool pressing_ = false;
  float size_, depth_m_;
  std::optional<Vec3f> taken_;  ///< where the pointer met the plane when the node was taken
};

}  // namespace palpate
