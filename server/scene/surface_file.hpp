// Triangles from the bytes of OBJ and STL files, unprocessed.
//
// The readers are our own because files come from the web, and no reader in Debian 12 withstands damaged ones: Assimp 5.2.5
// writes beyond its buffers at damaged OBJ files, tinyobjloader allocates 300 kB for a line of 14 bytes ("t"), admesh reads no
// OBJ and terminates the program. A body needs little: the lines `v` and `f` of OBJ, the corners of STL. Everything else is
// ignored.
//
// Memory and time are bounded by a multiple of the bytes given. Both readers throw an InputError that begins with `where`.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/patch/triangle_tree.hpp"

namespace palpate {

inline constexpr std::size_t kMaxTriangles = 2'000'000, kMaxSurfaceVertices = 3 * kMaxTriangles;
inline constexpr std::size_t kMaxCorners = 1'000;  ///< most corners of a polygon: the cost of cutting one grows with their square

/// Reads lines `v x y z` and `f a b c ...`, where a is the number of a vertex from 1 on or, from -1 down, counted back from the
/// last one; anything after a slash is ignored. Polygons become triangles.
TriangleMesh read_obj(std::string_view text, const std::string& where);

/// Reads the text kind or the binary one.
TriangleMesh read_stl(std::string_view bytes, const std::string& where);

/// Returns the bytes of a binary STL file, whose coordinates are floats.
std::string as_stl(const TriangleMesh& mesh);

/// Cuts a polygon into size - 2 triangles over all of its corners, with the orientation of the polygon, by ear clipping (Meisters
/// 1975) in the plane of its mean normal (Newell). A polygon that crosses itself is cut too, in an unspecified way.
void cut_polygon(std::span<const std::uint32_t> polygon, std::span<const Vec3> x, std::vector<Triangle>& out);

}  // namespace palpate
