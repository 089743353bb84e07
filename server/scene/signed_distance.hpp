// A solid defined by its signed distance: negative inside, zero on the surface, positive outside [m].
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <span>

#include "server/scene/settings.hpp"

namespace palpate {

class SignedDistance {
 public:
  virtual ~SignedDistance() = default;
  /// Signed distance: exact to first order near the surface; elsewhere the sign is right and the size a fair estimate.
  virtual double distance(const Vec3& p) const = 0;
  /// Returns a point of the surface close to p, for p not far from it.
  virtual Vec3 nearest(const Vec3& p) const = 0;
  /// Returns a box that holds the solid.
  virtual Eigen::AlignedBox3d bounds() const = 0;
  /// Volume [m^3]; 0 if unknown.
  virtual double volume() const { return 0; }
};

/// Ellipsoids joined by a smooth union. With a = distance to one and b to the next, in the order given,
///     union(a, b) = min(a, b) - h^2 blend / 4,   h = max(blend - |a - b|, 0) / blend,
/// so the surface bulges by at most blend / 4 where two meet and is exact away from there; blend = 0 is the plain union.
/// The distance to one ellipsoid is |p/r| (|p/r| - 1) / |p/r^2| in its own axes (first order at its surface).
std::unique_ptr<SignedDistance> make_ellipsoids(std::span<const EllipsoidSettings> ellipsoids, double blend_m);

/// Rotation about x, then y, then z (fixed axes).
Mat3 rotation_xyz(const Vec3& degrees);

}  // namespace palpate
