// Surface of a body whose cells are in copies: outer faces are split where cut links cross them, and walls join what the cut
// parts.
//
// Walls by dual contouring: every cut cell has a vertex m, the mean of the points where its cut links are crossed, every split
// outer face one likewise, and an outer link the point where it is crossed itself. Around each cut link the vertices of its cells
// (and outer faces) make a polygon, once for either side, with the copies of that side:
//
//     x(m) = 1/n sum over the n cut links (a, b) of the cell (1 - t) x_a + t x_b,   x_a, x_b nodes of the copy
//
// so the two walls of a cut lie on each other at rest and part as the copies do. The surface is closed, and where it would touch
// itself along an edge the vertices are doubled, so that each edge has two triangles. Pockets without a volume,
// where a link is cut but nothing parts, are left out.
//
// Source: Wu, Dick and Westermann, Efficient collision detection for composite finite element simulation of cuts in deformable
// bodies, The Visual Computer 29 (2013), for dual contouring of cut links.
#pragma once

#include "server/scene/cell_copies.hpp"

namespace palpate {

struct CutSurface {
  std::vector<Triangle> triangles;       ///< over the nodes of the copies, then `embedded`
  std::vector<EmbeddedVertex> embedded;  ///< over the nodes of the copies
};

/// `x` and `triangles`: of the body as it was, whose faces are triangles or pairs of them. `kept`: the copies that stay.
CutSurface cut_surface(const CutCells& cut, const std::vector<Vec3>& x, const std::vector<Triangle>& triangles,
                       const std::vector<std::uint8_t>& kept);

}  // namespace palpate
