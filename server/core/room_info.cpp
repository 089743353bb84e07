#include "server/core/room_info.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "server/scene/tools.hpp"

namespace palpate {
namespace {

constexpr std::uint32_t kNone = ~0u;

/// Spreads ten bits to every third bit of the result, from the lowest.
std::uint32_t spread(std::uint32_t ten_bits) {
  std::uint32_t bits = 0;
  for (unsigned k = 0; k < 10; ++k) bits |= (ten_bits >> k & 1u) << 3 * k;
  return bits;
}

std::uint32_t place_on_curve(const Vec3& x, const Vec3& low, double extent) {
  std::uint32_t place = 0;
  for (int k = 0; k < 3; ++k) place |= spread(static_cast<std::uint32_t>(1023 * (x[k] - low[k]) / extent)) << k;
  return place;
}

/// Two triangles for each cell of a planar lattice, counter-clockwise seen from +z. Every cell has a spring along each diagonal;
/// the ends of the one from its lowest corner are both joined to the two other corners, and to no other node.
std::vector<Triangle> sheet_triangles(const LumpedBody& body) {
  constexpr double kDiagonal = 0.3;  // least share of its length along x and y; a lateral spring has 0 along one of them
  std::vector<std::vector<std::uint32_t>> joined(body.nodes.size());
  for (const Element& e : body.elements) {
    joined[e.a].push_back(e.b);
    joined[e.b].push_back(e.a);
  }
  std::vector<Triangle> triangles;
  for (const Element& e : body.elements) {
    const Vec3 along = body.nodes[e.b] - body.nodes[e.a];
    if (std::min(along.x() * along.x(), along.y() * along.y()) < kDiagonal * kDiagonal * along.squaredNorm()) continue;
    if (along.x() * along.y() < 0) continue;
    for (const std::uint32_t corner : joined[e.a]) {
      if (std::find(joined[e.b].begin(), joined[e.b].end(), corner) == joined[e.b].end()) continue;
      const bool left = along.cross(body.nodes[corner] - body.nodes[e.a]).z() > 0;
      triangles.push_back(left ? Triangle{e.a, e.b, corner} : Triangle{e.b, e.a, corner});
    }
  }
  return triangles;
}

std::vector<std::uint32_t> nodes_of(const std::vector<Triangle>& triangles, const LumpedBody& body) {
  std::vector<std::uint32_t> nodes;
  for (const Triangle& t : triangles) nodes.insert(nodes.end(), t.begin(), t.end());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  Vec3 low = Vec3::Constant(1e300), high = -low;
  for (const std::uint32_t node : nodes) {
    low = low.cwiseMin(body.nodes[node]);
    high = high.cwiseMax(body.nodes[node]);
  }
  const double extent = std::max((high - low).maxCoeff(), 1e-9);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
  for (const std::uint32_t node : nodes) order.emplace_back(place_on_curve(body.nodes[node], low, extent), node);
  std::sort(order.begin(), order.end());
  std::transform(order.begin(), order.end(), nodes.begin(), [](const auto& entry) { return entry.second; });
  return nodes;
}

}  // namespace

RoomInfo facts_of(const Scene& scene, const Vec3& home) {
  const LumpedBody& body = scene.body;
  const std::vector<Triangle> triangles = body.planar ? sheet_triangles(body) : body.triangles;
  RoomInfo facts{
      scene.name, scene.tool.contact,     home, static_cast<std::uint32_t>(body.nodes.size()), {}, nodes_of(triangles, body), 0,
      scene.task, drawn_shape(scene.tool)};
  std::vector<std::uint32_t> vertex_of(body.nodes.size(), kNone);
  for (const std::uint32_t node : facts.node_of) {
    vertex_of[node] = static_cast<std::uint32_t>(facts.mesh.vertices.size());
    const bool fixed = node < body.fixed.size() && body.fixed[node] != 0;
    facts.mesh.vertices.push_back({body.nodes[node].unaryExpr(&to_rest_step), fixed});
  }
  for (const Triangle& t : triangles) facts.mesh.triangles.push_back({vertex_of[t[0]], vertex_of[t[1]], vertex_of[t[2]]});
  facts.mesh_hash = mesh_hash(facts.mesh);
  return facts;
}

}  // namespace palpate
