// The solid inside a closed triangle mesh.
//
// The nearest point is found through a tree of boxes; the sign comes from the angle-weighted pseudonormal of the face, edge or
// vertex on which that point lies (Baerentzen and Aanaes, 2005), which is right for every closed mesh, sharp edges included.
#pragma once

#include <memory>

#include "server/scene/mesh_file.hpp"
#include "server/scene/solid.hpp"

namespace palpate {

std::unique_ptr<Solid> make_mesh_solid(TriangleMesh mesh);

}  // namespace palpate
