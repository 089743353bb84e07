#include "server/scene/members.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/plain_text.hpp"
#include "server/scene/mesh_solid.hpp"
#include "server/scene/overlap.hpp"
#include "server/scene/parts.hpp"
#include "server/scene/settings_fields.hpp"

namespace palpate {
namespace {

std::vector<Vec3> surface_of(const LumpedBody& body) {
  std::vector<std::uint32_t> nodes;
  for (const Triangle& t : body.triangles) nodes.insert(nodes.end(), t.begin(), t.end());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  std::vector<Vec3> x;
  for (const std::uint32_t i : nodes) x.push_back(body.nodes[i]);
  return x;
}

std::shared_ptr<const DistanceGrid> distance_of(const LumpedBody& body) {
  constexpr double kPerEdge = 4;
  const auto solid = make_mesh_solid({body.nodes, body.triangles});
  Eigen::AlignedBox3d box;
  for (const Vec3& x : surface_of(body)) box.extend(x);
  const double points = std::min(kMostGridPoints, (kPerEdge / mean_edge_m(body) * box.sizes()).prod());
  return std::make_shared<const DistanceGrid>(Mat3::Identity(), Vec3::Zero(), box.min(), box.max(), points,
                                              [&](const Vec3& p) { return solid->distance(p); });
}

bool same_relaxation(const LumpedBody& a, const LumpedBody& b) {
  return std::equal(a.relaxation.begin(), a.relaxation.end(), b.relaxation.begin(), b.relaxation.end(),
                    [](const PronyBranch& p, const PronyBranch& q) { return p.share == q.share && p.time_s == q.time_s; });
}

/// Returns what two bodies do not have in common; null if they can be joined.
const char* difference(const LumpedBody& a, const LumpedBody& b) {
  if (a.hexahedra.empty() != b.hexahedra.empty()) return "other elements";
  if (a.materials.front().parameters() != b.materials.front().parameters()) return "another law, shape of it or fibres";
  if (!same_relaxation(a, b)) return "another relaxation";
  if (a.mass_damping_1_s != b.mass_damping_1_s) return "another mass_damping_1_s";
  if (a.gravity_m_s2 != b.gravity_m_s2) return "another gravity_m_s2";
  return nullptr;
}

void refuse_overlap(const std::vector<LumpedBody>& bodies, const std::vector<MemberSettings>& members, const SceneText& text) {
  for (std::size_t m = 0; m < bodies.size(); ++m) {
    const auto solid = make_mesh_solid({bodies[m].nodes, bodies[m].triangles});
    for (std::size_t n = 0; n < bodies.size(); ++n) {
      if (n == m) continue;
      const Overlap overlap = deepest(*solid, surface_of(bodies[n]));
      if (overlap.depth_m > kTouchM)
        text.refuse(at("bodies", std::max(m, n)),
                    fmt::format("bodies[{}] (\"{}\") and bodies[{}] (\"{}\") overlap by {:.3g} mm at {}", std::min(m, n),
                                members[std::min(m, n)].name, std::max(m, n), members[std::max(m, n)].name, 1e3 * overlap.depth_m,
                                in_words(overlap.place)),
                    "bodies that touch each other at most");
    }
  }
}

}  // namespace

LumpedBody joined(std::vector<LumpedBody> bodies, std::vector<Member> members) {
  LumpedBody all;
  std::vector<Tetrahedron> membranes;
  double volume_share = 0;
  for (std::size_t m = 0; m < bodies.size(); ++m) {
    LumpedBody& body = bodies[m];
    const auto first = static_cast<std::uint32_t>(all.nodes.size()), material = static_cast<std::uint32_t>(all.materials.size());
    const auto take = [&](auto cell) {
      for (std::uint32_t& node : cell.nodes) node += first;
      cell.material += material;
      return cell;
    };
    members[m].first_node = first;
    members[m].end_node = first + static_cast<std::uint32_t>(body.nodes.size());
    members[m].distance = distance_of(body);
    for (const Hexahedron& cell : body.hexahedra) all.hexahedra.push_back(take(cell));
    for (const Tetrahedron& cell : body.tetrahedra) (cell.is_triangle() ? membranes : all.tetrahedra).push_back(take(cell));
    for (const Triangle& t : body.triangles) all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    all.nodes.insert(all.nodes.end(), body.nodes.begin(), body.nodes.end());
    all.masses_kg.insert(all.masses_kg.end(), body.masses_kg.begin(), body.masses_kg.end());
    all.fixed.insert(all.fixed.end(), body.fixed.begin(), body.fixed.end());
    all.materials.insert(all.materials.end(), body.materials.begin(), body.materials.end());
    volume_share = std::max(volume_share, body.left_out_share);
  }
  all.tetrahedra.insert(all.tetrahedra.end(), membranes.begin(), membranes.end());
  all.relaxation = bodies.front().relaxation;
  all.mass_damping_1_s = bodies.front().mass_damping_1_s;
  all.gravity_m_s2 = bodies.front().gravity_m_s2;
  all.left_out_share = volume_share;
  all.members = std::move(members);
  return all;
}

LumpedBody join_members(std::vector<LumpedBody> bodies, const std::vector<MemberSettings>& members, const SceneText& text) {
  for (std::size_t m = 1; m < bodies.size(); ++m)
    if (const char* other = difference(bodies.front(), bodies[m]))
      text.refuse(at("bodies", m),
                  fmt::format("bodies[{}] (\"{}\") has {} than bodies[0] (\"{}\")", m, members[m].name, other, members[0].name),
                  "the same of all bodies; they may differ in young_pa, poisson, damping_s and density");
  refuse_overlap(bodies, members, text);
  std::vector<Member> of;
  for (const MemberSettings& member : members) {
    Member& to = of.emplace_back();
    to.name = member.name;
    to.colour = member.colour;
    to.friction = member.friction;
    to.touches_itself = member.touches_itself;
  }
  return joined(std::move(bodies), std::move(of));
}

}  // namespace palpate
