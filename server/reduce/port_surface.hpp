// The piece of surface that travels with a touch patch: triangles around the way that the tool will go, as many as fit.
//
// It begins with the triangle of the contact point p and grows by one triangle at a time: of those that have at least two
// vertices in the piece and that it still has room for, the one whose centroid c_t is nearest to the way ahead,
//
//     d(t) = min_(0 <= s <= 1) |c_t - p - s a|,     a how far the contact is expected to get
//
// Room ends at kMaxPortTriangles, at a number of vertices, and at most_triangles() of these. Vertex i moves with the modes by
// R_i = sum_j S_ij V_j, the weights of the skin (skin.hpp) over the rows of its nodes.
//
// Shapes: c_t, p, a 3 [m], at the stamp; V_j, R_i 3 x r [kg^-1/2], r modes.
// What can go wrong: a is straight, so over a surface that bends much the piece may lie beside the way that the contact takes;
// beyond the piece it goes on in the plane at the rim (beyond_border() of surface.hpp).
#pragma once

#include <functional>

#include "common/port/nonlinear_terms.hpp"
#include "server/body/dynamics.hpp"
#include "server/body/skin.hpp"

namespace palpate {

/// Fills patch.surface and patch.point. `ahead` is how far the contact is expected to get [m]: the piece grows around the line
/// from the contact point to there. `x` are the skin's vertices; `rows` are those of the patch's basis for a node; vertex i of
/// the piece gets its position, its rows and, at the rim, the normal that it has on the whole surface. Of its `vertices_max`
/// vertices and the triangles between them the first `vertices_first` at most, and some triangles, make a piece of their own: its
/// numbers of vertices and triangles are returned.
struct SurfacePiece {
  int vertices = 0, triangles = 0;
};
SurfacePiece cut_port_surface(const Skin& skin, const std::vector<double>& x,
                              const std::function<PortRows(std::uint32_t node)>& rows, const SurfacePoint& point,
                              const Vec3& ahead, int vertices_first, int vertices_max, Patch& patch);
/// Leaves the first piece to the patch; the rest goes with the terms.
void split_surface(const SurfacePiece& first, PortSurface& surface, NonlinearTerms& terms);

}  // namespace palpate
