// The closed surface of a ball.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "client/viewer/surface.hpp"

namespace palpate::test {

inline std::pair<std::vector<Vec3f>, std::vector<Triangle>> ball(const Vec3f& center, float radius, std::uint32_t around = 16) {
  std::vector<Vec3f> points{center + Vec3f(0, 0, radius)};
  std::vector<Triangle> triangles;
  const std::uint32_t rings = around / 2 - 1;
  const auto at = [&](std::uint32_t ring, std::uint32_t k) { return 1 + ring * around + k % around; };
  for (std::uint32_t ring = 0; ring < rings; ++ring)
    for (std::uint32_t k = 0; k < around; ++k) {
      const double v = M_PI * (ring + 1) / (rings + 1), u = 2 * M_PI * k / around;
      points.push_back(center + radius * Vec3f(static_cast<float>(std::sin(v) * std::cos(u)),
                                               static_cast<float>(std::sin(v) * std::sin(u)), static_cast<float>(std::cos(v))));
    }
  const auto last = static_cast<std::uint32_t>(points.size());
  points.push_back(center - Vec3f(0, 0, radius));
  for (std::uint32_t k = 0; k < around; ++k) {
    triangles.push_back({0, at(0, k), at(0, k + 1)});
    triangles.push_back({last, at(rings - 1, k + 1), at(rings - 1, k)});
    for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
      triangles.push_back({at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)});
      triangles.push_back({at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)});
    }
  }
  return {points, triangles};
}

}  // namespace palpate::test
