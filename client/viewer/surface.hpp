// Properties of a deformed surface for the renderer: normals, whether it is closed, its size. In frame W, single precision
// (display only).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/patch/patch.hpp"
#include "common/patch/surface.hpp"

namespace palpate {

using Vec3f = Eigen::Vector3f;

/// normal_i = sum over the triangles around i of angle_at_i * unit normal, normalised (independent of the tessellation). z for a
/// vertex that no triangle uses. `triangles` index into `positions`.
void update_normals(std::span<const Triangle> triangles, std::span<const Vec3f> positions, std::vector<Vec3f>& normals);

/// True when every edge lies between two triangles of the same orientation: the inside is not visible.
bool is_closed(std::span<const Triangle> triangles);

/// Depth of `point` below a closed surface, by its nearest point [m]; 0 outside, and for a surface that is not closed.
class DepthGauge {
 public:
  DepthGauge() = default;
  DepthGauge(std::span<const Triangle> triangles, std::span<const Vec3f> positions);
  float at(const Vec3& point) const;

 private:
  Surface surface_;  ///< empty when it is not closed
  std::vector<double> positions_;
};

struct Box {
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();
  Vec3f center() const { return 0.5F * (low + high); }
  float diagonal() const { return (high - low).norm(); }
};

/// Returns the box of the vertices that triangles use, of all vertices when there is no triangle; a unit box when there are none.
Box bounds(std::span<const Triangle> triangles, std::span<const Vec3f> positions);

}  // namespace palpate
