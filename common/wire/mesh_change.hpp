// A change of the mesh of a body that is cut while the room runs: one MeshPiece after those of the scene's mesh.
#pragma once

#include "common/wire/messages.hpp"

namespace palpate {

/// Adds the vertices or triangles of a piece at the end, or removes triangles by number. Returns false, with the mesh as it was,
/// for a piece that does not fit.
bool apply(const MeshPiece& piece, BodyMesh& mesh);

}  // namespace palpate
