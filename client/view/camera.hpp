// A camera on a sphere around its target; z is up. Angles in radians, lengths in metres, frame W.
#pragma once

#include <Eigen/Core>

#include "client/viewer/surface.hpp"

namespace palpate {

class Camera {
 public:
  enum class Side { three_quarter, top, front, side };

  /// Fits the view to the surface so that all of it, and room above it for an instrument, fills the picture (aspect = width /
  /// height), except the share of its width at the right that panels cover.
  void fit(std::span<const Triangle> triangles, std::span<const Vec3f> positions, float aspect, float covered = 0);
  /// Moves the middle of the picture to the middle of the part that panels leave free.
  void cover(float share) { covered_ = share; }
  void look_from(Side side);
  /// Lets fit() come nearer by this factor.
  void come_nearer(float times) { nearer_ = times; }
  /// Turns by a mouse drag: a drag across the whole height turns by half a circle.
  void orbit(float dx, float dy);
  /// Moves sideways by a drag in fractions of the picture's height.
  void pan(float dx, float dy);
  /// Zooms; positive: closer.
  void zoom(float steps);

  Eigen::Matrix4f view() const;
  Eigen::Matrix4f projection(float aspect) const;
  Vec3f eye() const;
  /// Columns right, up and back (towards the eye).
  Eigen::Matrix3f axes() const;

 private:
  static constexpr float kAzimuth = -0.95F, kElevation = 0.62F;  ///< three quarters, high enough to look into an indentation
  float azimuth_ = kAzimuth, elevation_ = kElevation, distance_ = 1.0F, size_ = 1.0F, covered_ = 0, nearer_ = 1;
  Vec3f target_ = Vec3f::Zero();
};

/// Returns the position of a point in pixels from the top left; z is the depth in [-1, 1], outside it the point is not visible.
Vec3f to_pixels(const Eigen::Matrix4f& view_projection, const Vec3f& point, float width, float height);

}  // namespace palpate
