// Facts about a room that stations receive. Plain data, so that sessions need no body.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/wire/body_mesh.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// A tool of the scene beside the first.
struct FurtherTool {
  HeldTool held;
  double coupling_n_m = 0;  ///< contact stiffness
};

/// The names of all tools, and what the further ones are.
struct RoomTools {
  std::string first = {};  ///< name of the first; empty: it has none
  std::vector<FurtherTool> further = {};
  /// Returns the number of the tool of that name, 0 for an empty one; none where there is no such tool.
  std::optional<std::uint8_t> number_of(const std::string& name) const;
};

struct RoomInfo {
  std::string scene;
  ContactKind contact = ContactKind::touch;
  Vec3 home = Vec3::Zero();              ///< start of a tool: Room::home()
  std::uint32_t nodes = 0;               ///< nodes of the body, inner ones included
  BodyMesh mesh;                         ///< its surface; for a planar body one side of the cells of its lattice
  std::vector<std::uint32_t> vertex_of;  ///< vertex of the body at each of the mesh
  std::uint64_t mesh_hash = 0;
  std::uint64_t scene_hash = 0;  ///< scene_hash()
  std::optional<Task> task = {};
  ToolShape tool = {};  ///< body of the first tool, as it is drawn
  std::vector<PartMesh> parts = {};
  std::vector<BodyName> bodies = {};  ///< of a scene with several
  double coupling_n_m = 0;            ///< contact stiffness of the first tool
  RoomTools tools = {};
};

/// Returns a vertex of the body at `rest` as viewers receive it.
MeshVertex drawn_vertex(const LumpedBody& body, std::uint32_t vertex, const Vec3& rest);

/// The mesh holds the vertices that triangles use, ordered along a space-filling curve (Z order, 10 bits per axis): vertices with
/// neighbouring numbers are near each other in space, so that a run of vertices moves as one.
RoomInfo facts_of(const Scene& scene, const Vec3& home);

}  // namespace palpate
