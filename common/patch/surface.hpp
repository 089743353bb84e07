// A triangulated surface that deforms: nearest points, smooth normals, inside and outside, and points that slide on it.
//
// Vertices x_i [m], triangles (a, b, c) counter-clockwise seen from outside, a point p = sum_k w_k x_(t_k) of triangle t with
// barycentric weights w_k >= 0, sum 1:
//
//     normal of a vertex    n_i = A_i / |A_i| + c_i,   A_i = sum over triangles around i of (x_b - x_a) x (x_c - x_a)
//     normal of a point     n = sum_k w_k n_(t_k), of length 1: continuous along the surface, so a sliding force has no jumps
//     nearest point to y    p* = argmin over all triangles of |p - y|, by Voronoi regions of the triangle
//     signed height         h = |y - p*|, with a minus where (y - p*) . n < 0 and the winding number is above that of an outside
//     winding number        sum_t Omega_t / (4 pi),  Omega_t the solid angle of triangle t,  with a, b, c its corners less y
//                           tan(Omega_t / 2) = a . (b x c) / (|a| |b| |c| + (a . b) |c| + (b . c) |a| + (c . a) |b|)
//     slide by s            the nearest point to p + s, from triangle to triangle around the best so far
//
// c_i: contribution to the direction of A_i of triangles that are missing at the rim of a piece; zero elsewhere, or none
// given. What can go wrong: a slide finds a local minimum, and stops after some rings of triangles; where all normals vanish the
// normal is that of the triangle, then z. The view does not own memory, so that the server's whole surface and the client's few
// triangles run the same code. Cost: nearest_point() and winding_number() visit all triangles; slide() neighbours only.
//
// Source: Ericson, Real-Time Collision Detection (2005), 5.1.5; Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/types.hpp"
#include "common/patch/patch.hpp"

namespace palpate {

/// Adjacency of a surface. Vertex i belongs to triangles incident[first[i]] ... incident[first[i + 1] - 1]. open[t] has bit k set
/// when the edge opposite corner k of triangle t has no other triangle.
struct SurfaceView {
  std::span<const Triangle> triangles;
  std::span<const std::uint32_t> first, incident;
  std::span<const std::uint8_t> open;
  std::span<const Vec3> normal_correction = {};  ///< one per vertex, or none
};

/// Fills adjacency for `vertices` vertices. Sizes: first vertices + 1, incident 3 * triangles, open triangles.
void connect_surface(std::span<const Triangle> triangles, std::size_t vertices, std::span<std::uint32_t> first,
                     std::span<std::uint32_t> incident, std::span<std::uint8_t> open) noexcept;

/// A surface that owns its adjacency.
class Surface {
 public:
  Surface() = default;
  Surface(std::vector<Triangle> triangles, std::size_t vertices);
  SurfaceView view() const { return {triangles_, first_, incident_, open_, {}}; }
  bool empty() const { return triangles_.empty(); }

 private:
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> first_, incident_;
  std::vector<std::uint8_t> open_;
};

/// Positions of vertices in any storage: 3 doubles a vertex.
using Positions = std::span<const double>;
inline Eigen::Map<const Vec3> vertex(Positions x, std::uint32_t i) {
  return Eigen::Map<const Vec3>(x.data() + 3 * std::size_t{i});
}

Vec3 position_at(const SurfaceView& s, Positions x, const SurfacePoint& p) noexcept;
/// Returns n_i: of length 1 where there is no normal_correction.
Vec3 vertex_normal(const SurfaceView& s, Positions x, std::uint32_t i) noexcept;
/// Returns the unit outward normal, interpolated.
Vec3 normal_at(const SurfaceView& s, Positions x, const SurfacePoint& p) noexcept;

/// Number of times that the surface encloses a point: 1 inside a closed one, 0 outside, even where it is folded or inside out.
/// For an open one the share of all directions in which its back is visible, minus that of its front: 1/2 next to it, 1/4 or less
/// behind its rim, and 0 from afar. Solid angles of the triangles over 4 pi (Van Oosterom and Strackee, IEEE Trans. Biomed. Eng.
/// 30, 1983).
double winding_number(const SurfaceView& s, Positions x, const Vec3& point) noexcept;
/// Returns the share of the way from a to b at which it goes out through the triangle p, q, r, none where it does not; for p, r,
/// q it goes in (Moeller and Trumbore).
std::optional<double> way_out(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, const Vec3& r) noexcept;

struct NearestPoint {
  SurfacePoint point;
  Vec3 position = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
  double height_m = 0;     ///< signed distance of the query, negative behind the surface by normal and winding number
  bool at_border = false;  ///< true: nearest point on an open edge: the query is beyond the border, not above the surface
};
/// True when the point lies on an edge with only one triangle.
bool on_open_edge(const SurfaceView& s, const SurfacePoint& p) noexcept;
/// Returns the nearest point over all triangles.
NearestPoint nearest_point(const SurfaceView& s, Positions x, const Vec3& query) noexcept;
/// Returns the point to which `p` slides by `slip`: the nearest to p + slip, searched outwards ring by ring.
SurfacePoint slide(const SurfaceView& s, Positions x, const SurfacePoint& p, const Vec3& slip) noexcept;
/// Returns the distance of `target` beyond a surface that ends at `p`, along the plane there, which continues the surface. Zero
/// where `p` is not on an open edge. For a piece of a surface; the body does not end there.
Vec3 beyond_border(const SurfaceView& s, Positions x, const SurfacePoint& p, const Vec3& target) noexcept;

}  // namespace palpate
