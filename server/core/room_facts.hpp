// What stations are told about a room. Plain data, so that the sessions need no body.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/wire/body_mesh.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct RoomFacts {
  std::string scene;
  ContactKind contact = ContactKind::touch;
  Vec3 home = Vec3::Zero();            ///< where a tool starts: Room::home()
  std::uint32_t nodes = 0;             ///< of the body, also those inside
  BodyMesh mesh;                       ///< of its surface; of a planar body the cells of its lattice, a side of them
  std::vector<std::uint32_t> node_of;  ///< node of each vertex of the mesh
  std::uint64_t mesh_hash = 0;
};

/// The mesh has the nodes that triangles use, along a space-filling curve (Z order, 10 bits an axis): what is next in number is
/// near in space, so that a run of vertices moves as one.
RoomFacts facts_of(const Scene& scene, const Vec3& home);

}  // namespace palpate
