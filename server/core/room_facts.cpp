#include "server/core/room_facts.hpp"

#include "common/wire/mesh_hash.hpp"

namespace palpate {
RoomFacts facts_of(const Scene& scene, const Vec3& home) {
  return {scene.name,
          scene.tool.contact,
          home,
          static_cast<std::uint32_t>(scene.body.nodes.size()),
          scene.body.triangles,
          mesh_hash(scene.body.nodes.size(), scene.body.triangles)};
}

}  // namespace palpate
