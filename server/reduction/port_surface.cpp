#include "server/reduction/port_surface.hpp"

#include <algorithm>
#include <cassert>
#include <span>

namespace palpate {

SurfacePiece cut_port_surface(const Skin& skin, const std::vector<double>& x,
                              const std::function<PortRows(std::uint32_t node)>& rows, const SurfacePoint& point,
                              const Vec3& ahead, int vertices_first, int vertices_max, Patch& patch) {
  const SurfaceView surface = skin.view();
  assert(point.triangle < surface.triangles.size() && 3 <= vertices_first && vertices_first <= vertices_max);
  assert(vertices_max <= kMaxPortVertices && x.size() % 3 == 0);
  const Vec3 centre = position_at(surface, x, point);
  std::vector<std::uint32_t> vertices, triangles{point.triangle};
  const auto corners = surface.triangles[point.triangle];
  vertices.assign(corners.begin(), corners.end());

  // Grow by the triangle nearest to the tool's path that shares an edge with the piece.
  const double length2 = ahead.squaredNorm();
  const auto centroid_distance = [&](std::uint32_t t) {
    const Vec3 d = position_at(surface, x, {t, Vec3::Constant(1.0 / 3)}) - centre;
    const double along = length2 > 0 ? std::clamp(d.dot(ahead) / length2, 0.0, 1.0) : 0.0;
    return (d - along * ahead).norm();
  };
  const auto has = [](const auto& list, std::uint32_t value) { return std::find(list.begin(), list.end(), value) != list.end(); };
  const auto grow = [&](int most) {
    std::uint32_t best = 0;
    double best_distance = 1e300;
    for (const std::uint32_t i : vertices)
      for (std::uint32_t k = surface.first[i]; k < surface.first[i + 1]; ++k) {
        const std::uint32_t t = surface.incident[k];
        if (has(triangles, t)) continue;
        const auto missing = std::count_if(surface.triangles[t].begin(), surface.triangles[t].end(),
                                           [&](std::uint32_t corner) { return !has(vertices, corner); });
        const int together = static_cast<int>(vertices.size() + missing);
        if (missing > 1 || together > most || static_cast<int>(triangles.size()) == most_triangles(together)) continue;
        const double distance = centroid_distance(t);
        if (distance < best_distance) {
          best_distance = distance;
          best = t;
        }
      }
    if (best_distance == 1e300) return false;
    triangles.push_back(best);
    for (const std::uint32_t corner : surface.triangles[best])
      if (!has(vertices, corner)) vertices.push_back(corner);
    return true;
  };
  const auto full = [&] { return static_cast<int>(triangles.size()) == kMaxPortTriangles; };
  while (!full() && grow(vertices_first)) continue;
  const SurfacePiece first{static_cast<int>(vertices.size()), static_cast<int>(triangles.size())};
  const std::vector<std::uint32_t> of_first = triangles;
  while (!full() && grow(vertices_max)) continue;

  const auto is_whole = [&](std::uint32_t i) {
    const auto around = surface.incident.subspan(surface.first[i], surface.first[i + 1] - surface.first[i]);
    return std::all_of(around.begin(), around.end(), [&](std::uint32_t t) { return has(of_first, t); });
  };
  PortSurface& piece = patch.surface;
  piece.vertex_count = static_cast<int>(vertices.size());
  piece.triangle_count = static_cast<int>(triangles.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    piece.vertices[i].position = vertex(x, vertices[i]);
    piece.vertices[i].normal = is_whole(vertices[i]) ? Vec3(Vec3::Zero()) : vertex_normal(surface, x, vertices[i]);
    const NodeWeights& smooth = skin.vertex_weights(vertices[i]);
    piece.vertices[i].rows = smooth.front().second * rows(smooth.front().first);
    for (const auto& [node, weight] : std::span(smooth).subspan(1)) piece.vertices[i].rows += weight * rows(node);
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      piece.triangles[t][k] = static_cast<std::uint32_t>(
          std::find(vertices.begin(), vertices.end(), surface.triangles[triangles[t]][k]) - vertices.begin());
  patch.point = {0, point.weight};
  return first;
}

void split_surface(const SurfacePiece& first, PortSurface& surface, NonlinearTerms& terms) {
  assert(first.vertices <= surface.vertex_count && first.triangles <= surface.triangle_count);
  terms.vertices.assign(surface.vertices.begin() + first.vertices, surface.vertices.begin() + surface.vertex_count);
  terms.triangles.assign(surface.triangles.begin() + first.triangles, surface.triangles.begin() + surface.triangle_count);
  surface.vertex_count = first.vertices;
  surface.triangle_count = first.triangles;
}

}  // namespace palpate
