// Contacts of a tool with rigid parts, which the client closes itself at the haptic rate: the parts never move, so neither a
// patch nor the link matters.
//
// Sphere j of the tool (tool_shape.hpp; a point is one of radius 0) has its centre at c, and q is the point of a part nearest to
// it. With s = |c - q|, negative where c is inside, n the unit vector from q to c, inside from c to q, P = 1 - n n^T:
//
//     d = r - s > 0:   F = k d n - T,   T = k P (p - a) cut to |T| <= mu k d,   p = c - r n
//
// a is the anchor: p where contact begins, then moved so that |k P (p - a)| <= mu k d. Contact begins only where the sphere has
// been outside, so a tool that is in a part when it appears is not thrown out. Force and torque are the sums.
//
// The sign of s holds until c has moved by |s|, and c is outside and farther than r until it has moved by s - r; so the winding
// number and the nearest point are computed where they may have changed, and the search for q begins at that of the tick before.
//
// Units: c, q, r, s, d, p, a m; k N/m; F, T N; frame W. Does not allocate, lock or throw after construction.
// What can go wrong: a sphere deeper than the middle of a part leaves it on the other side; k is for one contact, and several
// add up.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/base/tool_shape.hpp"
#include "common/base/wrench.hpp"
#include "common/patch/triangle_tree.hpp"

namespace palpate {

inline constexpr std::size_t kMostWalls = 16;

/// State of a tool's contacts with parts.
struct WallTouches {
  struct Touch {
    bool was_outside = false, touching = false;
    Vec3 anchor = Vec3::Zero();
    Vec3 centre = Vec3::Zero(), nearest = Vec3::Zero();  ///< c and q where q was computed last
    double distance_m = 0;                               ///< s there; 0 where it is unknown
  };
  std::array<std::array<Touch, kMaxToolSpheres>, kMostWalls> of;  ///< by part, then by sphere
};

class PartWalls {
 public:
  /// An empty `tool` is a point. Parts beyond kMostWalls and without triangles are left out.
  PartWalls(std::span<const TriangleMesh> parts, std::span<const double> friction, const ToolShape& tool, double stiffness_n_m);
  /// Returns the wrench on the tool, with contacts of at most `most_n_m` each.
  Wrench push(const ToolPose& tool, double most_n_m, WallTouches& touches) const noexcept;
  double stiffness_n_m() const { return stiffness_n_m_; }

 private:
  struct Wall {
    TriangleTree tree;
    double friction = 0;
  };
  bool locate(const Wall& wall, const Vec3& centre, double radius_m, WallTouches::Touch& touch) const noexcept;
  Vec3 push(const Wall& wall, const Vec3& centre, double radius_m, double stiffness_n_m,
            WallTouches::Touch& touch) const noexcept;

  std::vector<Wall> walls_;
  ToolShape tool_;
  double stiffness_n_m_ = 0;
};

}  // namespace palpate
