// The god-object: the position that the tool would have if it could not enter a rigid, triangulated body, and the force towards
// it.
//
//     proxy g = argmin |g - h|^2   over the points reachable from the last g without crossing a triangle from outside
//     force on the tool = k (g - h)
//
// h tool, k stiffness [N/m]. The proxy moves straight towards h until it meets a triangle, whose plane then constrains it, n_i .
// g = d_i, and it continues towards the point of the constraints nearest to h,
//     g = h + N (N^T N)^-1 (d - N^T h),    N = (n_1 ... n_k), k <= 3
// So it remembers the side on which it came in, which depth alone does not give. It keeps kClearance off the planes, so that
// rounding does not put it behind one. Every triangle is tried, which suits bodies of hundreds of them.
// Source: Zilles and Salisbury, IROS 1995.
//
// For comparison the penalty method: force k (p - h) on a tool inside, p the nearest point of the surface, regardless of the
// path.
#pragma once

#include <span>
#include <vector>

#include "common/port/surface.hpp"

namespace palpate {

/// A rigid body: closed, triangles counter-clockwise seen from outside.
struct RigidBody {
  std::vector<double> vertices;  ///< 3 doubles each [m]
  Surface surface;
};

/// An axis-parallel box.
RigidBody box(const Vec3& low, const Vec3& high);

class GodObject {
 public:
  /// `body` must outlive this object. `start` lies outside.
  GodObject(const RigidBody& body, const Vec3& start) : body_(&body), position_(start) {}
  /// Follows the tool to `tool`; returns the proxy.
  const Vec3& follow(const Vec3& tool);
  const Vec3& position() const { return position_; }
  /// Number of planes that hold the proxy, 0 if it is at the tool.
  int constraints() const { return constraints_; }
  /// Returns k (g - h), zero if the proxy is at the tool.
  Vec3 force(const Vec3& tool, double stiffness_n_m) const;

  static constexpr double kClearanceM = 1e-7;

 private:
  const RigidBody* body_;
  Vec3 position_;
  int constraints_ = 0;
};

/// Force of the penalty method on a tool at `tool` [N].
Vec3 penalty_force(const RigidBody& body, const Vec3& tool, double stiffness_n_m);

}  // namespace palpate
