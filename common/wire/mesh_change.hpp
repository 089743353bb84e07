// A change of the mesh of a body that is cut while the room runs: one MeshPiece after those of the scene's mesh.
#pragma once

#include "common/wire/messages.hpp"

namespace palpate {

/// Adds the vertices and triangles of a piece at the end, and removes triangles by the numbers that they had before it. Returns
/// false, with the mesh as it was, for a piece that does not fit.
bool apply(const MeshPiece& piece, BodyMesh& mesh);

/// Returns the piece, however large, that makes `before` a mesh with the triangles of `now`, in any order. `now` has the vertices
/// of `before`, and more at the end.
MeshPiece change_of(const BodyMesh& before, const BodyMesh& now);

}  // namespace palpate
