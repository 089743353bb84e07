#include "server/scene/mesh_body.hpp"

#include <map>

#include "server/scene/fixing.hpp"
#include "server/scene/materials.hpp"
#include "server/scene/tetra_file.hpp"

namespace palpate {
namespace {

/// Material numbers in place of the file's region numbers, which may be any.
void set_materials(LumpedBody& body, const MeshBodySettings& settings, const SceneText& text) {
  body.materials = {settings.solid.material};
  std::map<std::uint32_t, std::uint32_t> of_region;
  for (const Tetrahedron& t : body.tetrahedra) of_region[t.material] = 0;
  for (std::size_t i = 0; i < settings.regions.size(); ++i) {
    const int id = settings.regions[i].id;
    const auto region = of_region.find(static_cast<std::uint32_t>(id));
    if (id < 0 || region == of_region.end()) {
      const std::string path = "body.mesh.regions[" + std::to_string(i) + "].id";
      text.refuse(path, path + " is " + std::to_string(id) + ", which no tetrahedron has", "a region of the mesh");
    }
    region->second = static_cast<std::uint32_t>(body.materials.size());
    body.materials.push_back(settings.regions[i].material);
  }
  for (Tetrahedron& t : body.tetrahedra) t.material = of_region.at(t.material);
}

}  // namespace

LumpedBody build_mesh_body(const MeshBodySettings& settings, const SceneText& text) {
  TetraMesh mesh = read_tetra_mesh(settings.mesh, text.where("body.mesh.file") + ": mesh " + settings.mesh.file);
  LumpedBody body;
  body.nodes = std::move(mesh.vertices);
  body.tetrahedra = std::move(mesh.cells);
  set_materials(body, settings, text);
  set_relaxation(body, settings.solid.relaxation);
  body.mass_damping_1_s = settings.solid.mass_damping_1_s;
  body.masses_kg = lumped_masses(body.tetrahedra, body.nodes, settings.density_kg_m3);
  body.triangles = outer_faces(body.tetrahedra);
  body.gravity_m_s2 = settings.gravity_m_s2;
  fix_nodes(body, settings.fixed, Vec3::Constant(mean_edge_m(body)));
  refuse_all_fixed(body, text, "body.mesh");
  return body;
}

}  // namespace palpate
