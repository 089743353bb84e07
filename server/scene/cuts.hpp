// Cuts that a scene gives: what the edge of a blade sweeps through a solid at rest.
//
// The edge, d long along the unit vector u, moves along the polyline p_1 .. p_n:
//
//     S = { p_i + r (p_(i+1) - p_i) + s d u :  0 <= r, s <= 1 }
//
// S cuts the links (edges of cells) that it crosses; a node within kOnSheet of a link's length of S counts as lying on the side
// to which (p_(i+1) - p_i) x u points. Cells whose corners a cut parts are doubled (cell_copies.hpp), and walls close the surface
// (cut_walls.hpp). A copy's share phi is that of the cell's 64 points (cell_points.hpp) that no sheet parts from its corners, at
// least kLeastShare. A cut thus ends between cells, up to one short of where the blade stopped. Pieces that nothing holds any
// more are left out, and stderr says so.
//
// Not modelled: walls that touch each other (they pass through one another), and tension before the cut.
#pragma once

#include <vector>

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// Cuts a finished body of hexahedra or tetrahedra. Returns the new number of each node, kNoNode for those left out: new nodes
/// come after the body's own, and before the fixed ends of ligaments. Throws InputError for a cut that crosses no link.
std::vector<std::uint32_t> cut_body(LumpedBody& body, const std::vector<CutSettings>& cuts, const SceneText& text);

}  // namespace palpate
