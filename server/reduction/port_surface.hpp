// The piece of surface in a touch patch: triangles around the expected path of the tool, as many as fit.
//
// It begins with the triangle of the contact point p and grows by one triangle at a time: among those that have at least two
// vertices in the piece and for which there is room, the one whose centroid c_t is nearest to the path ahead,
//
//     d(t) = min_(0 <= s <= 1) |c_t - p - s a|,     a the expected displacement of the contact
//
// Its second part, which travels with the terms, has the triangles of the tool's other contacts first, and grows around the
// paths of all of them, d(t) the least: it may be in several parts.
//
// Room ends at kMaxPortTriangles, at a number of vertices, and at most_triangles() of these. Vertex i moves with the modes by
// R_i = sum_j S_ij V_j, the weights of the skin (skin.hpp) over the rows of its nodes.
//
// Shapes: c_t, p, a 3 [m], at the stamp; V_j, R_i 3 x r [kg^-1/2], r modes.
// Limits: a is straight, so on a strongly curved surface the piece may miss the path of the contact; beyond the piece the surface
// continues as the plane at the rim (beyond_border() of surface.hpp).
#pragma once

#include <functional>
#include <span>

#include "common/patch/nonlinear_terms.hpp"
#include "server/body/dynamics.hpp"
#include "server/body/skin.hpp"

namespace palpate {

/// A contact point, and its expected displacement [m]: the piece grows around the line along it.
struct ContactPath {
  SurfacePoint point;
  Vec3 ahead = Vec3::Zero();
};
/// Fills patch.surface and patch.point. `paths`: of the contact at which the patch is made, then of the tool's others. `x`:
/// positions of the skin's vertices; `rows`: those of the patch's basis for a node. Vertex i of the piece gets its position, its
/// rows and, at the rim, its normal on the whole surface. Of its `vertices_max` vertices and the triangles between them, at most
/// the first `vertices_first` with some triangles form a first piece, whose numbers of vertices and triangles are returned.
struct SurfacePiece {
  int vertices = 0, triangles = 0;
};
SurfacePiece cut_port_surface(const Skin& skin, const std::vector<double>& x,
                              const std::function<PortRows(std::uint32_t node)>& rows, std::span<const ContactPath> paths,
                              int vertices_first, int vertices_max, Patch& patch);
/// Leaves the first piece in the patch and moves the rest into the terms.
void split_surface(const SurfacePiece& first, PortSurface& surface, NonlinearTerms& terms);

}  // namespace palpate
