// The solid inside a closed triangle mesh: all points around which the mesh winds once or more (triangle_tree.hpp). Shells that
// overlap or contain each other form one solid; a shell whose triangles face into it is a cavity.
//
// The surface of such a solid has the solid on one side only. Triangles within the solid are omitted; those that cross another
// shell are omitted in parts of 1 / kPieces of the size.
#pragma once

#include <memory>

#include "server/scene/mesh_file.hpp"
#include "server/scene/signed_distance.hpp"

namespace palpate {

std::unique_ptr<SignedDistance> make_mesh_solid(TriangleMesh mesh);

}  // namespace palpate
