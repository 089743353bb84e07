// Triangles of everything but the body: instruments and force arrows, rebuilt for each frame (a few hundred each).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "client/viewer/surface.hpp"
#include "common/base/tool_shape.hpp"
#include "common/wire/body_mesh.hpp"

namespace palpate {

struct SolidVertex {
  Vec3f position, normal, color;  ///< frame W; color linear
  float gloss = 0;                ///< 0 matt to 1 polished

  bool operator==(const SolidVertex& other) const = default;
};
using SolidMesh = std::vector<SolidVertex>;  ///< three vertices a triangle

/// One ring of a turned part: radius and height along the axis [m], and the appearance of the section from here to the next ring.
struct Ring {
  float radius = 0, height = 0;
  Vec3f color = Vec3f::Ones();
  float gloss = 0;
};

/// Turns a profile around an axis through `base`. Neighbouring sections share normals where they bend by less than 45 degrees.
void append_turned(SolidMesh& mesh, const Vec3f& base, const Vec3f& axis, const std::vector<Ring>& profile);

/// A slender stylus whose ball tip is centred on the tool point.
struct Stylus {
  Vec3f tip = Vec3f::Zero();
  float tip_radius = 0;
  Vec3f color = Vec3f::Ones();  ///< colour of its collar, and of its button while pressed; sRGB
  /// Axes of T (common/base/tool_pose.hpp) in W. Without them the device has three degrees of freedom: the direction of the shaft
  /// is a convention, up, leaning to the back right, and there is no button.
  std::optional<Eigen::Matrix3f> axes = {};
  bool pressed = false;
};
void append_stylus(SolidMesh& mesh, const Stylus& stylus);

/// A tool with a body: its spheres, those of one radius and one jaw that follow each other joined to a rod, and a thin handle
/// along z with a collar in the station's colour.
struct Instrument {
  ToolPose pose;
  std::span<const ToolSphere> body;
  Vec3f color = Vec3f::Ones();  ///< sRGB
};
void append_instrument(SolidMesh& mesh, const Instrument& instrument);

/// Appends a rigid part. Triangles that meet at less than 30 degrees share normals.
void append_part(SolidMesh& mesh, const PartMesh& part);

/// Appends an arrow of the given length from `from`; nothing when it is shorter than its own width.
void append_arrow(SolidMesh& mesh, const Vec3f& from, const Vec3f& along, float width, const Vec3f& color_srgb);

}  // namespace palpate
