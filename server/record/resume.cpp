#include "server/record/resume.hpp"

#include <fmt/format.h>

#include "common/base/error.hpp"
#include "server/core/room_info.hpp"

namespace palpate {
namespace {

void check(const RecordingHead& head, const std::string& where, const std::string& room, const Scene& scene) {
  if (head.kind != RecordingKind::room)
    throw InputError(where, "is a station's recording", "one of a room, made by palpate-server");
  if (head.name != room)
    throw InputError(where, fmt::format("is of room \"{}\"", head.name), fmt::format("of room \"{}\"", room));
  const std::size_t vertices = scene.body.vertices();
  if (head.surface.body_vertices != vertices)
    throw InputError(where, fmt::format("is of a body of {} vertices", head.surface.body_vertices),
                     fmt::format("the {} of scene \"{}\"; move the file away to begin at rest", vertices, scene.name));
  if (head.surface.mesh_hash != facts_of(scene, Vec3::Zero()).mesh_hash)
    throw InputError(where, "is of a body with another surface",
                     fmt::format("that of scene \"{}\"; move the file away to begin at rest", scene.name));
}

}  // namespace

std::optional<ResumePoint> newest_checkpoint(const RecordingReader& recording, const std::string& where, const std::string& room,
                                             const Scene& scene) {
  const RecordingHead& head = recording.head();
  check(head, where, room, scene);
  for (std::size_t k = recording.blocks().size(); k-- > 0;) {
    const auto block = recording.read(k);
    if (!block || block->checkpoints.empty()) continue;
    const RecordedCheckpoint& newest = block->checkpoints.back();
    if (newest.positions.size() != scene.body.nodes.size())
      throw InputError(where, fmt::format("its newest checkpoint has {} nodes", newest.positions.size()),
                       fmt::format("the {} of its scene", scene.body.nodes.size()));
    return ResumePoint{newest, head.unix_time + (newest.t - head.clock_time)};
  }
  return std::nullopt;
}

Vector in_a_row(const std::vector<Vec3>& points) {
  Vector row(3 * static_cast<Eigen::Index>(points.size()));
  for (std::uint32_t k = 0; k < points.size(); ++k) at_node(row, k) = points[k];
  return row;
}

}  // namespace palpate
