#include "client/viewer/surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {

void update_normals(std::span<const Triangle> triangles, std::span<const Vec3f> x, std::vector<Vec3f>& normals) {
  normals.assign(x.size(), Vec3f::Zero());
  for (const Triangle& t : triangles) {
    const Vec3f n = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
    const float area2 = n.norm();
    if (!(area2 > 0)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3f a = x[t[(k + 1) % 3]] - x[t[k]], b = x[t[(k + 2) % 3]] - x[t[k]];
      normals[t[k]] += n / area2 * std::atan2(area2, a.dot(b));
    }
  }
  for (Vec3f& n : normals) n = n.squaredNorm() > 0 ? n.normalized() : Vec3f::UnitZ();
}

bool is_closed(std::span<const Triangle> triangles) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> there, back;
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      there.emplace_back(t[k], t[(k + 1) % 3]);
      back.emplace_back(t[(k + 1) % 3], t[k]);
    }
  std::sort(there.begin(), there.end());
  std::sort(back.begin(), back.end());
  return !there.empty() && there == back && std::adjacent_find(there.begin(), there.end()) == there.end();
}

DepthGauge::DepthGauge(std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
  if (!is_closed(triangles)) return;
  surface_ = Surface({triangles.begin(), triangles.end()}, positions.size());
  for (const Vec3f& p : positions)
    for (int k = 0; k < 3; ++k) positions_.push_back(p[k]);
}

float DepthGauge::at(const Vec3& point) const {
  if (surface_.empty()) return 0;
  return std::max(0.0F, -static_cast<float>(nearest_point(surface_.view(), positions_, point).height_m));
}

Box bounds(std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
  if (positions.empty()) return {Vec3f::Constant(-0.5F), Vec3f::Constant(0.5F)};
  const Vec3f first = positions[triangles.empty() ? 0 : triangles[0][0]];
  Box box{first, first};
  if (triangles.empty()) {
    for (const Vec3f& p : positions) box = {box.low.cwiseMin(p), box.high.cwiseMax(p)};
  }
  for (const Triangle& t : triangles) {
    for (const std::uint32_t v : t) {
      box.low = box.low.cwiseMin(positions[v]);
      box.high = box.high.cwiseMax(positions[v]);
    }
  }
  return box;
}

}  // namespace palpate
