// Closed triangle meshes from OBJ and STL files (surface_file.hpp).
//
// Vertices at the same position (within a millionth of the size) are merged; normals, texture coordinates and materials are
// dropped. Small faults are repaired (surface_repair.hpp), with a line on stderr. A mesh that cannot bound a solid is refused:
// unreadable, without triangles, with an edge that has more triangles one way than the other, one-sided, without volume, or of a
// size that no touchable object has.
#pragma once

#include <string>

#include "server/scene/settings.hpp"
#include "server/scene/surface_file.hpp"

namespace palpate {

/// Formats a position in a mesh, for a person.
std::string in_words(const Vec3& point);

/// Refuses a vertex farther than kMaxCoordinateM from the origin, or not finite: throws an InputError that begins with `where`.
void check_place(std::span<const Vec3> vertices, const std::string& where);

/// Returns the triangles of a file as they are. Throws an InputError that begins with `where`.
TriangleMesh read_surface(const std::filesystem::path& file, const std::string& where);
/// Sides of the box around the points.
Vec3 extent_of(std::span<const Vec3> points);

/// Reads the mesh of a scene and scales, rotates, moves and repairs it. Throws an InputError that begins with `where`.
TriangleMesh read_closed_mesh(const MeshSettings& settings, const std::string& where);
/// The same for triangles already read from a file.
TriangleMesh closed_mesh(const TriangleMesh& given, const MeshSettings& settings, const std::string& where);

}  // namespace palpate
