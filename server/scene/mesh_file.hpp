// Closed triangle meshes from OBJ and STL files (read by Assimp).
//
// Vertices at the same place (within a millionth of the size) become one; normals, texture coordinates and materials are dropped.
// A mesh that cannot bound a solid is refused: unreadable, no triangles, an open edge, an edge of three triangles, triangles that
// run against each other, no volume, or a size that is not that of something to touch.
#pragma once

#include <string>
#include <vector>

#include "common/port/patch.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

struct TriangleMesh {
  std::vector<Vec3> vertices;       ///< [m]
  std::vector<Triangle> triangles;  ///< counter-clockwise seen from outside
};

/// A place of a mesh, for people.
std::string in_words(const Vec3& point);

/// The mesh of a scene in its place: scaled, rotated, moved. A mesh that is inside out is turned, with a line on stderr.
/// Throws InputError that begins with `where`.
TriangleMesh read_closed_mesh(const MeshSettings& settings, const std::string& where);

}  // namespace palpate
