// The mesh of a surface that blades change: of the vertices that its triangles have ever used, which keep their places.
#pragma once

#include "common/wire/body_mesh.hpp"
#include "server/room/live_surface.hpp"

namespace palpate {

class SurfaceMesh {
 public:
  /// `mesh`: of the scene; `vertex_of`: vertex of the body at each of its vertices.
  SurfaceMesh(BodyMesh mesh, std::vector<std::uint32_t> vertex_of);
  /// Makes it that of this surface: new vertices come at the end.
  void take(const BodySurface& surface);
  const BodyMesh& mesh() const { return mesh_; }
  /// Vertex of the body, by the numbers of its surface, at each of the mesh.
  const std::vector<std::uint32_t>& vertex_of() const { return vertex_of_; }

 private:
  BodyMesh mesh_;
  std::vector<std::uint32_t> vertex_of_, place_of_;
};

}  // namespace palpate
