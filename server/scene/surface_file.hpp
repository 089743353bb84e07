// Triangles from the bytes of OBJ and STL files, as the files have them.
//
// The readers are our own, for files come from the web and no reader that Debian 12 has stands them: Assimp 5.2.5 writes behind
// its buffers at damaged OBJ files, tinyobjloader makes 300 kB of a line of 14 bytes ("t"), admesh reads no OBJ and ends the
// program. What a body needs is small: of OBJ the lines `v` and `f`, of STL the corners. Everything else is passed over.
//
// Memory and time stay within some multiple of the bytes given. Both throw InputError that begins with `where`.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/port/patch.hpp"

namespace palpate {

struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;  ///< counter-clockwise seen from outside
};

inline constexpr std::size_t kMaxTriangles = 2'000'000, kMaxSurfaceVertices = 3 * kMaxTriangles;
inline constexpr std::size_t kMaxCorners = 1'000;  ///< of a polygon: cutting one takes the square of them

/// Lines `v x y z` and `f a b c ...`, where a is a number of a vertex from 1 on or, from -1 down, back from the last one; what
/// follows a slash is passed over. Polygons become triangles.
TriangleMesh read_obj(std::string_view text, const std::string& where);

/// Of the text kind, or of the binary one.
TriangleMesh read_stl(std::string_view bytes, const std::string& where);

/// Cuts a polygon into its size - 2 triangles over all of its corners, which run as the polygon does: ears are cut off (Meisters
/// 1975) in the plane of its mean normal (Newell). One that crosses itself is cut too, somehow.
void cut_polygon(std::span<const std::uint32_t> polygon, std::span<const Vec3> x, std::vector<Triangle>& out);

}  // namespace palpate
