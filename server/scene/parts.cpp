#include "server/scene/parts.hpp"

#include <fmt/format.h>

#include <set>

#include "common/base/plain_text.hpp"
#include "server/scene/mesh_file.hpp"
#include "server/scene/mesh_solid.hpp"
#include "server/scene/overlap.hpp"
#include "server/scene/settings_fields.hpp"

namespace palpate {
namespace {

constexpr std::uint32_t kUsualColour = 0xc8c8d0;

RigidPart grid_of(TriangleMesh mesh, const SignedDistance& solid, const Mat3& rotation) {
  RigidPart part;
  Eigen::AlignedBox3d box;
  for (const Vec3& v : mesh.vertices) {
    part.box.extend(v);
    box.extend(rotation.transpose() * v);
  }
  part.distance = DistanceGrid(rotation, Vec3::Zero(), box.min(), box.max(), kMostGridPoints,
                               [&](const Vec3& p) { return solid.distance(p); });
  part.vertices = std::move(mesh.vertices);
  part.triangles = std::move(mesh.triangles);
  return part;
}

}  // namespace

std::vector<PartSettings> read_parts(const SceneText& text, const SceneSettings& scene) {
  std::vector<PartSettings> out;
  const auto& in = text.values().parts;
  if (in.size() > kMostParts)
    text.refuse("parts", fmt::format("parts has {} of them", in.size()), fmt::format("at most {}", kMostParts));
  std::set<std::string> names;
  for (const MemberSettings& member : scene.members) names.insert(member.name);
  for (std::size_t i = 0; i < in.size(); ++i) {
    const schema::PartT& part = *in[i];
    const std::string path = at("parts", i);
    if (scene.lattice.planar) text.refuse(path, path + " is given with a sheet", "a body in three dimensions");
    if (!scene.cuts.empty() || (scene.tool.needle && scene.tool.needle->is_blade))
      text.refuse(path, path + " is given with a body that is cut", "rigid parts or cuts");
    if (!is_name(part.name)) text.refuse(path + ".name", std::string("1 to 64 bytes of ") + kNameCharacters);
    if (!names.insert(part.name).second)
      text.refuse(path + ".name", path + ".name is \"" + part.name + "\", as that of a body or a part before",
                  "a name of its own");
    if (!part.mesh) text.refuse(path + ".mesh", "an object with the file of a closed surface");
    text.in_range(path + ".mu", part.mu, 0, 2, "");
    text.in_range(path + ".stiffness_ratio", part.stiffness_ratio, 0.1, 100, "");
    out.push_back({part.name, read_mesh_file(text, path + ".mesh", *part.mesh),
                   read_colour(text, path + ".colour", part.colour, kUsualColour), part.mu, part.stiffness_ratio});
  }
  return out;
}

RigidPart make_part(std::vector<Vec3> vertices, std::vector<Triangle> triangles, const Mat3& rotation) {
  TriangleMesh mesh{std::move(vertices), std::move(triangles)};
  const auto solid = make_mesh_solid(mesh);
  return grid_of(std::move(mesh), *solid, rotation);
}

void add_parts(LumpedBody& body, const std::vector<PartSettings>& parts, const SceneText& text) {
  if (parts.empty()) return;
  const std::vector<Vec3> vertices = vertices_at_rest(body);
  std::set<std::uint32_t> on_surface;
  for (const Triangle& t : body.triangles) on_surface.insert(t.begin(), t.end());
  std::vector<Vec3> surface;
  for (const std::uint32_t i : on_surface) surface.push_back(vertices[i]);
  const auto inside_body = make_mesh_solid({vertices, body.triangles});
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string path = at("parts", i), file = path + ".mesh.file";
    TriangleMesh mesh = read_closed_mesh(parts[i].mesh, text.where(file) + ": mesh " + parts[i].mesh.file);
    if (mesh.triangles.size() > kMostPartTriangles)
      text.refuse(file, fmt::format("mesh {} has {} triangles", parts[i].mesh.file, mesh.triangles.size()),
                  fmt::format("at most {}", kMostPartTriangles));
    const auto solid = make_mesh_solid(mesh);
    Overlap overlap = deepest(*solid, surface);
    if (const Overlap other = deepest(*inside_body, mesh.vertices); other.depth_m > overlap.depth_m) overlap = other;
    if (overlap.depth_m > kTouchM)
      text.refuse(path,
                  fmt::format("{} (\"{}\") and the body overlap by {:.3g} mm at {}", path, parts[i].name, 1e3 * overlap.depth_m,
                              in_words(overlap.place)),
                  "a part that touches the body at most");
    RigidPart part = grid_of(std::move(mesh), *solid, rotation_xyz(parts[i].mesh.rotation_deg));
    part.name = parts[i].name;
    part.colour = parts[i].colour;
    part.friction = parts[i].friction;
    part.stiffness_ratio = parts[i].stiffness_ratio;
    body.parts.push_back(std::make_shared<const RigidPart>(std::move(part)));
  }
}

}  // namespace palpate
