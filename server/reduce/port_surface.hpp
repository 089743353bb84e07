// The piece of surface that travels with a touch patch: triangles around the way that the tool will go, as many as fit.
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
