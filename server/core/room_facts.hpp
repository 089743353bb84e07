// What stations are told about a room. Plain data, so that the sessions need no body.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

struct RoomFacts {
  std::string scene;
  ContactKind contact = ContactKind::touch;
  Vec3 home = Vec3::Zero();         ///< where a tool starts: Room::home()
  std::uint32_t vertices = 0;       ///< all nodes of the body
  std::vector<Triangle> triangles;  ///< of its surface; empty for planar bodies
  std::uint64_t mesh_hash = 0;      ///< of vertex count and triangles: the same topology, the same number
};

RoomFacts facts_of(const Scene& scene, const Vec3& home);

}  // namespace palpate
