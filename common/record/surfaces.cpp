#include "common/record/surfaces.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/wire/mesh_change.hpp"

namespace palpate {

BodyMesh mesh_of(const RecordedSurface& surface) {
  BodyMesh mesh;
  for (std::size_t i = 0; i < surface.rest.size(); ++i)
    read_mark(surface.marks[i], mesh.vertices.emplace_back(MeshVertex{surface.rest[i]}));
  mesh.triangles = surface.triangles;
  return mesh;
}

BodyMesh in_order(BodyMesh mesh) {
  std::sort(mesh.triangles.begin(), mesh.triangles.end());
  return mesh;
}

void RecordedSurfaces::take(const RecordedMeshChange& change) {
  (change.whole ? wholes_ : steps_).try_emplace(change.number, change.piece);
}

bool RecordedSurfaces::change(const MeshPiece& piece) {
  if (!apply(piece, mesh_)) return false;
  mesh_ = in_order(std::move(mesh_));
  return true;
}

/// Makes mesh_ that of the number: from the present one, or from the newest whole one up to it.
bool RecordedSurfaces::reach(std::uint32_t number) {
  const auto step_on = [&] {
    for (; number_ < number; ++number_) {
      const auto step = steps_.find(number_ + 1);
      if (step == steps_.end() || !change(step->second)) return false;
    }
    return true;
  };
  if (number_ > 0 && number_ <= number && step_on()) return true;
  const auto after = wholes_.upper_bound(number);
  mesh_ = ordered_;
  number_ = 0;
  if (after == wholes_.begin()) return step_on();
  if (!change(std::prev(after)->second)) return false;
  number_ = std::prev(after)->first;
  return step_on();
}

const BodyMesh* RecordedSurfaces::mesh_of(const RecordedShape& shape) {
  const BodyMesh* mesh = shape.mesh == 0 ? &first_ : nullptr;
  if (!mesh) {
    if (!reach(shape.mesh)) {
      number_ = 0;
      return nullptr;
    }
    mesh = &mesh_;
  }
  return mesh->vertices.size() == shape.positions.size() ? mesh : nullptr;
}

}  // namespace palpate
