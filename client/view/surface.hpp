// What the renderer needs to know about a deformed surface: normals, whether it is closed, how large it is. In frame W, single
// precision (display only).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/port/patch.hpp"
#include "common/port/surface.hpp"

namespace palpate {

using Vec3f = Eigen::Vector3f;

/// normal_i = sum over the triangles around i of angle_at_i * unit normal, normalised (independent of the tessellation). z for a
/// vertex that no triangle uses. `triangles` index into `positions`.
void update_normals(std::span<const Triangle> triangles, std::span<const Vec3f> positions, std::vector<Vec3f>& normals);

/// Every edge lies between two triangles that turn the same way: what is inside cannot be seen.
bool is_closed(std::span<const Triangle> triangles);

/// How deep `point` lies below a closed surface, by its nearest point [m]; 0 outside, and of a surface that is not closed.
class DepthGauge {
 public:
  DepthGauge() = default;
  DepthGauge(std::span<const Triangle> triangles, std::span<const Vec3f> positions);
  float at(const Vec3& point) const;

 private:
  Surface surface_;  ///< empty where it is not closed
  std::vector<double> positions_;
};

struct Box {
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();
  Vec3f center() const { return 0.5F * (low + high); }
  float diagonal() const { return (high - low).norm(); }
};

/// Box of the vertices that triangles use, of all when there is no triangle; a unit box when there is nothing.
Box bounds(std::span<const Triangle> triangles, std::span<const Vec3f> positions);

}  // namespace palpate
