#include "server/reduction/port_surface.hpp"

#include <algorithm>
#include <cassert>
#include <span>

namespace palpate {

SurfacePiece cut_port_surface(const Skin& skin, const std::vector<double>& x,
                              const std::function<PortRows(std::uint32_t node)>& rows, std::span<const ContactPath> paths,
                              int vertices_first, int vertices_max, Patch& patch) {
  const SurfaceView surface = skin.view();
  const SurfacePoint& point = paths.front().point;
  assert(point.triangle < surface.triangles.size() && 3 <= vertices_first && vertices_first <= vertices_max);
  assert(vertices_max <= kMaxPortVertices && x.size() % 3 == 0);
  std::vector<std::uint32_t> vertices, triangles{point.triangle};
  const auto corners = surface.triangles[point.triangle];
  vertices.assign(corners.begin(), corners.end());

  // Grow by the triangle nearest to the paths that shares an edge with the piece.
  std::span<const ContactPath> around = paths.first(1);
  const auto centroid_distance = [&](std::uint32_t t) {
    const Vec3 centroid = position_at(surface, x, {t, Vec3::Constant(1.0 / 3)});
    double least = 1e300;
    for (const auto& [from, ahead] : around) {
      const Vec3 d = centroid - position_at(surface, x, from);
      const double length2 = ahead.squaredNorm(), along = length2 > 0 ? std::clamp(d.dot(ahead) / length2, 0.0, 1.0) : 0.0;
      least = std::min(least, (d - along * ahead).norm());
    }
    return least;
  };
  const auto has = [](const auto& list, std::uint32_t value) { return std::find(list.begin(), list.end(), value) != list.end(); };
  const auto missing_of = [&](std::uint32_t t) {
    return std::count_if(surface.triangles[t].begin(), surface.triangles[t].end(),
                         [&](std::uint32_t corner) { return !has(vertices, corner); });
  };
  const auto add = [&](std::uint32_t t) {
    triangles.push_back(t);
    for (const std::uint32_t corner : surface.triangles[t])
      if (!has(vertices, corner)) vertices.push_back(corner);
  };
  const auto grow = [&](int most) {
    std::uint32_t best = 0;
    double best_distance = 1e300;
    for (const std::uint32_t i : vertices)
      for (std::uint32_t k = surface.first[i]; k < surface.first[i + 1]; ++k) {
        const std::uint32_t t = surface.incident[k];
        if (has(triangles, t)) continue;
        const auto missing = missing_of(t);
        const int together = static_cast<int>(vertices.size() + missing);
        if (missing > 1 || together > most || static_cast<int>(triangles.size()) == most_triangles(together)) continue;
        const double distance = centroid_distance(t);
        if (distance < best_distance) {
          best_distance = distance;
          best = t;
        }
      }
    if (best_distance == 1e300) return false;
    add(best);
    return true;
  };
  const auto full = [&] { return static_cast<int>(triangles.size()) == kMaxPortTriangles; };
  while (!full() && grow(vertices_first)) continue;
  const SurfacePiece first{static_cast<int>(vertices.size()), static_cast<int>(triangles.size())};
  const std::vector<std::uint32_t> of_first = triangles;
  around = paths;
  for (const ContactPath& path : paths.subspan(1)) {
    const std::uint32_t t = path.point.triangle;
    if (!full() && !has(triangles, t) && static_cast<int>(vertices.size() + missing_of(t)) <= vertices_max) add(t);
  }
  while (!full() && grow(vertices_max)) continue;

  const auto is_whole = [&](std::uint32_t i) {
    const auto at = surface.incident.subspan(surface.first[i], surface.first[i + 1] - surface.first[i]);
    return std::all_of(at.begin(), at.end(), [&](std::uint32_t t) { return has(of_first, t); });
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
