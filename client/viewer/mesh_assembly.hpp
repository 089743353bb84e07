// The mesh of the body, assembled from pieces that arrive in any order, repeatedly or not at all.
//
// The announcement in a Welcome allocates nothing: memory is used by the received pieces, and the mesh is built when all are
// there. Where a blade cuts the body, more pieces follow, which change the mesh (mesh_change.hpp): those up to a number that was
// announced are applied together.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

class MeshAssembly {
 public:
  /// Discards everything and expects the mesh that a Welcome announced.
  void expect(std::uint32_t vertices, std::uint32_t triangles, std::uint64_t hash);
  /// Returns true when this is the mesh that is expected.
  bool expects(std::uint32_t vertices, std::uint32_t triangles, std::uint64_t hash) const {
    return vertices == vertices_ && triangles == triangles_ && hash == hash_;
  }

  /// Keeps a piece that fits into the expected mesh. When the last one has arrived and the hash is not the announced one, all are
  /// dropped (counted in `rejected`) and requested again.
  void take(const MeshPiece& piece);

  /// Returns the next missing pieces, at most `most`; piece 0 alone until their number is known.
  std::vector<std::uint32_t> missing(std::size_t most) const;
  /// Expects the pieces of changes, up to this number of all; returns true if some of them are new.
  bool want(std::uint32_t pieces);
  /// Returns true when the scene's mesh is there, and what was taken of its changes.
  bool complete() const { return complete_; }
  /// Returns true when all wanted changes are there as well.
  bool current() const { return complete_ && applied_ >= wanted_; }
  /// Number of pieces of changes in the mesh.
  std::uint32_t changes() const { return applied_ - std::min(applied_, scene_pieces_); }
  const BodyMesh& mesh() const { return mesh_; }
  std::uint64_t rejected() const { return rejected_; }

 private:
  bool fits(const MeshPiece& piece) const;
  bool covers_all() const;
  void finish();
  void take_change(const MeshPiece& piece);

  std::uint32_t vertices_ = 0, triangles_ = 0, count_ = 0;     ///< count_: number of pieces, 0 until the first one reports it
  std::uint32_t scene_pieces_ = 0, applied_ = 0, wanted_ = 0;  ///< of the scene's mesh; of all, in the mesh and wanted
  std::uint64_t hash_ = 0, rejected_ = 0;
  std::map<std::uint32_t, MeshPiece> pieces_;
  BodyMesh mesh_;  ///< empty until it is complete
  bool complete_ = false;
};

}  // namespace palpate
