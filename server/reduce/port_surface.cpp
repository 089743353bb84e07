#include "server/reduce/port_surface.hpp"

#include <algorithm>

namespace palpate {

void cut_port_surface(const Skin& skin, const std::vector<double>& x, const Matrix& v, const SurfacePoint& point,
                      const Vec3& ahead, int vertices_max, Patch& patch) {
  const SurfaceView surface = skin.view();
  const Vec3 centre = position_at(surface, x, point);
  std::vector<std::uint32_t> vertices, triangles{point.triangle};
  const auto corners = surface.triangles[point.triangle];
  vertices.assign(corners.begin(), corners.end());

  // Grow by the triangle nearest to the way of the tool that shares an edge with the piece.
  const double length2 = ahead.squaredNorm();
  const auto centroid_distance = [&](std::uint32_t t) {
    const Vec3 d = position_at(surface, x, {t, Vec3::Constant(1.0 / 3)}) - centre;
    const double along = length2 > 0 ? std::clamp(d.dot(ahead) / length2, 0.0, 1.0) : 0.0;
    return (d - along * ahead).norm();
  };
  const auto has = [](const auto& list, std::uint32_t value) { return std::find(list.begin(), list.end(), value) != list.end(); };
  while (static_cast<int>(triangles.size()) < kMaxPortTriangles) {
    std::uint32_t best = 0;
    double best_distance = 1e300;
    for (const std::uint32_t i : vertices)
      for (std::uint32_t k = surface.first[i]; k < surface.first[i + 1]; ++k) {
        const std::uint32_t t = surface.incident[k];
        if (has(triangles, t)) continue;
        const auto missing = std::count_if(surface.triangles[t].begin(), surface.triangles[t].end(),
                                           [&](std::uint32_t corner) { return !has(vertices, corner); });
        if (missing > 1 || static_cast<int>(vertices.size()) + missing > vertices_max) continue;
        const double distance = centroid_distance(t);
        if (distance < best_distance) {
          best_distance = distance;
          best = t;
        }
      }
    if (best_distance == 1e300) break;
    triangles.push_back(best);
    for (const std::uint32_t corner : surface.triangles[best])
      if (!has(vertices, corner)) vertices.push_back(corner);
  }

  const auto is_whole = [&](std::uint32_t i) {
    const auto around = surface.incident.subspan(surface.first[i], surface.first[i + 1] - surface.first[i]);
    return std::all_of(around.begin(), around.end(), [&](std::uint32_t t) { return has(triangles, t); });
  };
  PortSurface& piece = patch.surface;
  piece.vertex_count = static_cast<int>(vertices.size());
  piece.triangle_count = static_cast<int>(triangles.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    piece.vertices[i].position = vertex(x, vertices[i]);
    piece.vertices[i].rows = PortRows::Zero(3, v.cols());
    piece.vertices[i].normal = is_whole(vertices[i]) ? Vec3(Vec3::Zero()) : vertex_normal(surface, x, vertices[i]);
    for (const auto& [node, weight] : skin.vertex_weights(vertices[i]))
      piece.vertices[i].rows += weight * v.middleRows<3>(3 * static_cast<Eigen::Index>(node));
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      piece.triangles[t][k] = static_cast<std::uint32_t>(
          std::find(vertices.begin(), vertices.end(), surface.triangles[triangles[t]][k]) - vertices.begin());
  patch.point = {0, point.weight};
}

}  // namespace palpate
