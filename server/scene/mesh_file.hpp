// Closed triangle meshes from OBJ and STL files (surface_file.hpp).
//
// Vertices at the same place (within a millionth of the size) become one; normals, texture coordinates and materials are dropped.
// Small faults are mended (surface_repair.hpp), with a line on stderr. A mesh that cannot bound a solid is refused: unreadable,
// no triangles, an open edge, an edge of three triangles, a surface with one side, no volume, or a size that is not that of
// something to touch.
#pragma once

#include <string>

#include "server/scene/settings.hpp"
#include "server/scene/surface_file.hpp"

namespace palpate {

/// A place of a mesh, for people.
std::string in_words(const Vec3& point);

/// Refuses a vertex farther than kMaxCoordinateM from the origin, or one that is not finite: an InputError that begins with
/// `where`.
void check_place(std::span<const Vec3> vertices, const std::string& where);

/// The mesh of a scene in its place: scaled, rotated, moved, mended.
/// Throws InputError that begins with `where`.
TriangleMesh read_closed_mesh(const MeshSettings& settings, const std::string& where);
/// The same of triangles as a file has them.
TriangleMesh closed_mesh(const TriangleMesh& given, const MeshSettings& settings, const std::string& where);

}  // namespace palpate
