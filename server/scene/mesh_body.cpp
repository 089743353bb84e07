#include "server/scene/mesh_body.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>

#include "server/scene/fixing.hpp"
#include "server/scene/materials.hpp"
#include "server/scene/tetra_file.hpp"

namespace palpate {
namespace {

/// Replaces the file's region numbers, which may be any, by material numbers.
void set_materials(LumpedBody& body, const MeshBodySettings& settings, const SceneText& text) {
  body.materials = {settings.solid.material};
  std::map<std::uint32_t, std::uint32_t> of_region;
  for (const Tetrahedron& t : body.tetrahedra) of_region[t.material] = 0;
  std::string regions;
  for (const auto& [region, material] : of_region) {
    constexpr std::size_t kNamed = 60;  // bytes
    regions += (regions.empty() ? "" : ", ") + (regions.size() < kNamed ? std::to_string(region) : std::string("..."));
    if (regions.size() > kNamed) break;
  }
  for (std::size_t i = 0; i < settings.regions.size(); ++i) {
    const int id = settings.regions[i].id;
    const auto region = of_region.find(static_cast<std::uint32_t>(id));
    if (id < 0 || region == of_region.end()) {
      const std::string path = "body.mesh.regions[" + std::to_string(i) + "].id";
      text.refuse(path, path + " is " + std::to_string(id) + ", which no tetrahedron has", "a region of the mesh: " + regions);
    }
    region->second = static_cast<std::uint32_t>(body.materials.size());
    body.materials.push_back(settings.regions[i].material);
  }
  for (Tetrahedron& t : body.tetrahedra) t.material = of_region.at(t.material);
}

/// Refuses parts connected by a node or an edge only and not fixed themselves: they hang on a hinge and swing without any force.
void check_hinges(const LumpedBody& body, std::span<const Tetrahedron> cells, const SceneText& text, const std::string& mesh) {
  const std::vector<std::uint32_t> parts = parts_by_faces(cells);
  std::map<std::uint32_t, std::set<std::uint32_t>> held_nodes;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    std::set<std::uint32_t>& held = held_nodes[parts[i]];
    for (const std::uint32_t node : cells[i].nodes)
      if (body.fixed[node] != 0) held.insert(node);
  }
  if (held_nodes.size() == 1) return;
  constexpr std::size_t kHolds = 3;
  const auto loose = std::ranges::count_if(held_nodes, [](const auto& part) { return part.second.size() < kHolds; });
  const std::string words = "has " + std::to_string(held_nodes.size()) +
                            " parts that hang together by nodes or edges alone (or whose faces do not match)";
  if (loose > 0)
    text.refuse("body.mesh.file", "mesh " + mesh + " " + words + ", of which " + std::to_string(loose) + " are not held",
                "cells that share faces, or every part held at three nodes");
  std::fprintf(stderr, "mesh %s: %s; each is held\n", mesh.c_str(), words.c_str());
}

}  // namespace

LumpedBody build_mesh_body(const MeshBodySettings& settings, const SceneText& text) {
  TetraMesh mesh = read_tetra_mesh(settings.mesh, text.where("body.mesh.file") + ": mesh " + settings.mesh.file);
  const std::vector<Tetrahedron> all = all_of(mesh);
  LumpedBody body;
  body.triangles = outer_faces(all);
  body.nodes = std::move(mesh.vertices);
  body.tetrahedra = std::move(mesh.cells);
  set_materials(body, settings, text);
  set_relaxation(body, settings.solid.relaxation);
  body.mass_damping_1_s = settings.solid.mass_damping_1_s;
  body.masses_kg = lumped_masses(body.tetrahedra, body.nodes, settings.density_kg_m3);
  body.gravity_m_s2 = settings.gravity_m_s2;
  fix_nodes(body, settings.fixed, Vec3::Constant(mean_edge_m(body)));
  refuse_all_fixed(body, text, "body.mesh");
  check_hinges(body, all, text, settings.mesh.file);
  return body;
}

}  // namespace palpate
