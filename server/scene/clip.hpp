// Cuts a lattice to a shape.
//
// 1. Cells whose centre is inside the solid are kept; of these only the largest part connected by faces, without cells attached
// by a single face.
// 2. Where kept cells touch by an edge or a corner only, cells are added until the outside is a manifold.
// 3. Nodes on the outside move to the true surface and spread evenly along it; inner nodes follow (harmonically). Nodes on the
// outside of the grid itself stay in its plane, so a grid smaller than the solid cuts it flat.
// 4. Cells that became flat (they were barely inside) are removed, and steps 2 and 3 repeated. If that does not help, moves are
// shortened. In the end no cell is squashed, no face folded and no element shorter than kMinLength spacings.
#pragma once

#include <span>
#include <vector>

#include "server/scene/grid.hpp"
#include "server/scene/signed_distance.hpp"
#include "server/scene/surface.hpp"

namespace palpate {

inline constexpr double kMinLength = 0.35;      ///< shortest element, in spacings
inline constexpr double kMinCellVolume = 0.15;  ///< smallest cell, in undeformed cells

/// Grid of this spacing around the solid, with a free cell on every side.
Grid grid_around(const SignedDistance& solid, double spacing_m);

struct Clipped {
  CellSet cells;
  NumberedNodes nodes;  ///< at their final positions
  std::vector<BoundaryFace> faces;
  std::size_t held_back = 0;          ///< nodes whose move was shortened
  double left_out_share = 0;          ///< dropped share of the cells with their centre inside: loose or apart
  double surface_distance_max_m = 0;  ///< largest distance of an outer node from the solid's surface
};

/// Performs steps 1 to 4; returns no cells if no centre is inside.
Clipped clip_lattice(const Grid& grid, const SignedDistance& solid);

/// Performs step 2: adds cells until the outside of `cells` is a manifold.
void make_manifold(CellSet& cells, const Grid& grid, const SignedDistance& solid);

/// Performs step 3, starting from the grid positions.
void snap_to_surface(Clipped& body, const Grid& grid, const SignedDistance& solid);

/// Cells smaller than kMinCellVolume.
std::vector<Index3> flat_cells(const Clipped& body, const Grid& grid);

/// Performs the last resort of step 4.
void shorten_moves(Clipped& body, const Grid& grid);

inline constexpr double kGoodQuality = 0.15;  ///< lowest quality_of the tetrahedra of a clipped solid

/// Shortens moves until none of the tetrahedra that the cells split into is flatter than kGoodQuality.
void shorten_moves_of_tetrahedra(Clipped& body, const Grid& grid);

}  // namespace palpate
