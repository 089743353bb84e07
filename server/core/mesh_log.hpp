// The mesh of a room whose body blades cut: that of the scene, and a log of pieces that change it.
//
// Each piece adds vertices at the end, removes triangles by their numbers at that moment (ascending; those after them close up),
// or adds triangles at the end. A viewer that applies all pieces in order has the mesh; one that joins late gets the same pieces
// after those of the scene's mesh, with the next numbers.
#pragma once

#include <vector>

#include "common/wire/messages.hpp"
#include "server/core/room_info.hpp"
#include "server/core/surface_mesh.hpp"

namespace palpate {

class MeshLog {
 public:
  explicit MeshLog(const RoomInfo& facts);
  /// Adds the pieces that make the mesh that of this surface; returns true if it was another.
  bool take(const std::shared_ptr<const BodySurface>& surface);
  const BodyMesh& mesh() const { return mesh_; }
  /// Vertex of the body, by the numbers of its surface, at each of the mesh.
  const std::vector<std::uint32_t>& vertex_of() const { return surface_.vertex_of(); }
  /// Number of all pieces, those of the scene's mesh included.
  std::uint32_t pieces() const { return scene_pieces_ + static_cast<std::uint32_t>(changes_.size()); }
  /// Returns piece number `piece` of a change: scene's pieces <= piece < pieces().
  const MeshPiece& change(std::uint32_t piece) const { return changes_[piece - scene_pieces_]; }
  std::uint32_t scene_pieces() const { return scene_pieces_; }

 private:
  void add(MeshPiece piece);

  std::uint64_t hash_;
  std::uint32_t scene_pieces_;
  BodyMesh mesh_;  // as viewers have it: its triangles are in another order than those of surface_
  SurfaceMesh surface_;
  std::vector<MeshPiece> changes_;
  std::shared_ptr<const BodySurface> taken_;
};

}  // namespace palpate
