// The solid inside a closed triangle mesh: all points around which it winds once or more (triangle_tree.hpp). Shells that overlap
// or lie in each other are one solid, a shell whose triangles face into it is a cavity.
//
// The surface of such a solid is what has the solid on one side only; triangles that lie within it are left out, those that
// cross another shell in parts of a kPieces-th of the size.
#pragma once

#include <memory>

#include "server/scene/mesh_file.hpp"
#include "server/scene/solid.hpp"

namespace palpate {

std::unique_ptr<Solid> make_mesh_solid(TriangleMesh mesh);

}  // namespace palpate
