#include "server/core/room_info.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "server/core/scene_hash.hpp"
#include "server/room/drawn_threads.hpp"
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

std::vector<std::uint32_t> vertices_of(const std::vector<Triangle>& triangles, const std::vector<Vec3>& rest) {
  std::vector<std::uint32_t> vertices;
  for (const Triangle& t : triangles) vertices.insert(vertices.end(), t.begin(), t.end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  Vec3 low = Vec3::Constant(1e300), high = -low;
  for (const std::uint32_t vertex : vertices) {
    low = low.cwiseMin(rest[vertex]);
    high = high.cwiseMax(rest[vertex]);
  }
  const double extent = std::max((high - low).maxCoeff(), 1e-9);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
  for (const std::uint32_t vertex : vertices) order.emplace_back(place_on_curve(rest[vertex], low, extent), vertex);
  std::sort(order.begin(), order.end());
  std::transform(order.begin(), order.end(), vertices.begin(), [](const auto& entry) { return entry.second; });
  return vertices;
}

void add_threads(const LumpedBody& body, RoomInfo& facts) {
  const DrawnThreads threads(body);
  std::vector<Vec3> rest;
  threads.append(rest);
  const auto first = static_cast<std::uint32_t>(facts.mesh.vertices.size());
  for (std::uint32_t k = 0; k < rest.size(); ++k) {
    facts.vertex_of.push_back(static_cast<std::uint32_t>(body.vertices()) + k);
    facts.mesh.vertices.push_back({.rest = rest[k].unaryExpr(&to_rest_step), .thread = true});
  }
  for (const Triangle& t : threads.triangles(first)) facts.mesh.triangles.push_back(t);
}

}  // namespace

MeshVertex drawn_vertex(const LumpedBody& body, std::uint32_t vertex, const Vec3& rest) {
  return {rest.unaryExpr(&to_rest_step), body.is_fixed(vertex), body.is_wall(vertex), body.member_of(vertex)};
}

std::optional<std::uint8_t> RoomTools::number_of(const std::string& name) const {
  if (name.empty() || name == first) return std::uint8_t{0};
  for (std::uint8_t k = 0; k < further.size(); ++k)
    if (further[k].held.name == name) return static_cast<std::uint8_t>(k + 1);
  return std::nullopt;
}

RoomInfo facts_of(const Scene& scene, const Vec3& home) {
  const LumpedBody& body = scene.body;
  const std::vector<Triangle> triangles = body.planar ? sheet_triangles(body) : body.triangles;
  const std::vector<Vec3> rest = vertices_at_rest(body);
  RoomInfo facts{scene.name, scene.tool.contact,           home, static_cast<std::uint32_t>(body.nodes.size()),
                 {},         vertices_of(triangles, rest), 0,    scene_hash(scene),
                 scene.task, drawn_shape(scene.tool)};
  std::vector<std::uint32_t> place_of(rest.size(), kNone);
  for (const std::uint32_t vertex : facts.vertex_of) {
    place_of[vertex] = static_cast<std::uint32_t>(facts.mesh.vertices.size());
    facts.mesh.vertices.push_back(drawn_vertex(body, vertex, rest[vertex]));
  }
  for (const Triangle& t : triangles) facts.mesh.triangles.push_back({place_of[t[0]], place_of[t[1]], place_of[t[2]]});
  add_threads(body, facts);
  facts.mesh_hash = mesh_hash(facts.mesh);
  facts.coupling_n_m = scene.tool.contact_stiffness_n_m;
  facts.tools.first = scene.tool.name;
  for (const ToolSpec& tool : scene.tools)
    facts.tools.further.push_back({{tool.name, drawn_shape(tool)}, tool.contact_stiffness_n_m});
  for (const auto& part : body.parts) {
    PartMesh& drawn = facts.parts.emplace_back(PartMesh{part->name, part->colour, part->friction, {{}, part->triangles}});
    for (const Vec3& vertex : part->vertices) drawn.mesh.vertices.push_back({vertex.unaryExpr(&to_rest_step)});
  }
  if (body.members.size() > 1)
    for (const Member& member : body.members) facts.bodies.push_back({member.name, member.colour});
  return facts;
}

}  // namespace palpate
