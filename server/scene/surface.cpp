#include "server/scene/surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace palpate {

namespace {

/// Corners of the face of a cell towards +axis (or -axis), as offsets from the cell, counter-clockwise seen from outside.
std::array<Index3, 4> face_corners(std::size_t axis, bool positive) {
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::array<Index3, 4> corners{};
  constexpr int kTurn[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& uv = kTurn[positive ? i : 3 - i];
    corners[i][axis] = positive ? 1 : 0;
    corners[i][u] = uv[0];
    corners[i][v] = uv[1];
  }
  return corners;
}

}  // namespace

std::vector<BoundaryFace> boundary_faces(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number) {
  std::vector<BoundaryFace> faces;
  cells.each([&](const Index3& c) {
    if (!cells.has(c)) return;
    for (std::size_t side = 0; side < 6; ++side) {
      const bool positive = side % 2 == 1;
      Index3 step{};
      step[side / 2] = positive ? 1 : -1;
      if (cells.has(c + step)) continue;
      const auto corners = face_corners(side / 2, positive);
      BoundaryFace face;
      for (std::size_t i = 0; i < 4; ++i) face.corners[i] = number[grid.index(c + corners[i])];
      // The lowest corner's parity alternates within a face plane; so does the diagonal through the corner of even parity.
      const Index3 low = c + corners[0];
      face.odd = (low[0] + low[1] + low[2]) % 2 != 0;
      if (!cells.inside(c + step)) face.wall = static_cast<std::int8_t>(side / 2);
      faces.push_back(face);
    }
  });
  return faces;
}

std::vector<Triangle> split_alternately(std::span<const BoundaryFace> faces) {
  std::vector<Triangle> out;
  out.reserve(2 * faces.size());
  for (const BoundaryFace& face : faces) {
    const auto& c = face.corners;
    if (face.odd) {
      out.insert(out.end(), {{c[0], c[1], c[3]}, {c[1], c[2], c[3]}});
    } else {
      out.insert(out.end(), {{c[0], c[1], c[2]}, {c[0], c[2], c[3]}});
    }
  }
  return out;
}

std::vector<Triangle> split_shorter(std::span<const BoundaryFace> faces, std::span<const Vec3> x) {
  std::vector<Triangle> out;
  out.reserve(2 * faces.size());
  for (const auto& face : faces) {
    const auto& c = face.corners;
    BoundaryFace choice = face;
    choice.odd = (x[c[1]] - x[c[3]]).squaredNorm() < (x[c[0]] - x[c[2]]).squaredNorm();
    const auto pair = split_alternately({&choice, 1});
    out.insert(out.end(), pair.begin(), pair.end());
  }
  return out;
}

double signed_volume(std::span<const Triangle> triangles, std::span<const Vec3> x) {
  if (triangles.empty()) return 0;
  const Vec3 origin = x[triangles[0][0]];  // near the surface, so that no digits cancel
  double six_volumes = 0;
  for (const auto& [a, b, c] : triangles) six_volumes += (x[a] - origin).dot((x[b] - origin).cross(x[c] - origin));
  return six_volumes / 6;
}

EdgeReport check_edges(std::span<const Triangle> triangles) {
  struct Edge {
    std::uint32_t low, high;
    bool up;
    bool operator<(const Edge& o) const { return std::tie(low, high, up) < std::tie(o.low, o.high, o.up); }
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto a = t[i], b = t[(i + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  }
  std::sort(edges.begin(), edges.end());

  EdgeReport report;
  std::array<std::array<std::uint32_t, 2>, 3> examples{};
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i, up = 0;
    for (; end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high; ++end) up += edges[end].up;
    const std::size_t n = end - i;
    const int fault = 2 * up == n ? 3 : n == 1 ? 0 : n > 2 ? 1 : 2;
    if (n > 2 && fault == 3) ++report.shared;
    if (fault < 3) {
      ++(fault == 0 ? report.open : fault == 1 ? report.crowded : report.flipped);
      examples[static_cast<std::size_t>(fault)] = {edges[i].low, edges[i].high};
    }
    i = end;
  }
  report.example = report.open ? examples[0] : report.crowded ? examples[1] : examples[2];
  return report;
}

}  // namespace palpate
