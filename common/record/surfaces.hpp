// The surfaces of a recorded body: that of the head, and those that blades made of it.
#pragma once

#include <map>
#include <optional>

#include "common/record/recording.hpp"

namespace palpate {

BodyMesh mesh_of(const RecordedSurface& surface);
/// Returns the mesh with its triangles in ascending order, as changes of a recording count them: their numbers do not depend on
/// the changes before.
BodyMesh in_order(BodyMesh mesh);

class RecordedSurfaces {
 public:
  explicit RecordedSurfaces(const RecordedSurface& first) : first_(palpate::mesh_of(first)), ordered_(in_order(first_)) {}
  /// Takes a change, in any order.
  void take(const RecordedMeshChange& change);
  /// Returns the surface of a shape, valid until the next call; null where changes are missing or damaged, or do not fit.
  const BodyMesh* mesh_of(const RecordedShape& shape);

 private:
  bool reach(std::uint32_t number);
  bool change(const MeshPiece& piece);

  BodyMesh first_, ordered_;
  BodyMesh mesh_;
  std::uint32_t number_ = 0;                           ///< of mesh_; 0: it is none
  std::map<std::uint32_t, MeshPiece> steps_, wholes_;  ///< by number
};

}  // namespace palpate
