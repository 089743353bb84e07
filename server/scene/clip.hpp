// Cutting a lattice to a shape.
//
// 1. Cells whose centre is inside the solid are kept; of these the largest part that hangs together by faces, without cells that
// hang on by
//    a single face.
// 2. Where kept cells touch by an edge or a corner only, cells are added until the outside is a manifold.
// 3. Nodes on the outside move to the true surface and spread evenly along it; the nodes inside follow (harmonically). Nodes on
// the outside
//    of the grid itself stay in its plane, so a grid smaller than the solid cuts it flat.
// 4. Cells that came out flat (they were barely inside) are taken away and 2 and 3 done again. Where that does not help, moves
// are shortened:
//    in the end no cell is squashed, no face folded and no element shorter than kMinLength spacings.
#pragma once

#include <span>
#include <vector>

#include "server/scene/grid.hpp"
#include "server/scene/solid.hpp"
#include "server/scene/surface.hpp"

namespace palpate {

inline constexpr double kMinLength = 0.35;      ///< shortest element in spacings
inline constexpr double kMinCellVolume = 0.15;  ///< smallest cell in undeformed cells

/// A grid of this spacing around the solid, with a free cell on every side.
Grid grid_around(const Solid& solid, double spacing_m);

struct Clipped {
  CellSet cells;
  NumberedNodes nodes;  ///< at their final places
  std::vector<BoundaryFace> faces;
  std::size_t held_back = 0;          ///< nodes whose move was shortened
  double left_out_share = 0;          ///< of the cells whose centre is inside: apart from the largest part, or loose
  double surface_distance_max_m = 0;  ///< of a node of the outside from the solid's surface
};

/// Steps 1 to 4; no cells when no centre is inside.
Clipped clip_lattice(const Grid& grid, const Solid& solid);

/// Step 2: adds cells until the outside of `cells` is a manifold.
void make_manifold(CellSet& cells, const Grid& grid, const Solid& solid);

/// Step 3, from the grid positions.
void snap_to_surface(Clipped& body, const Grid& grid, const Solid& solid);

/// Cells of less than kMinCellVolume.
std::vector<Index3> flat_cells(const Clipped& body, const Grid& grid);

/// The last resort of step 4.
void shorten_moves(Clipped& body, const Grid& grid);

inline constexpr double kGoodQuality = 0.15;  ///< of the tetrahedra of a clipped solid (quality_of)

/// Shortens moves until none of the tetrahedra that the cells split into is flatter than kGoodQuality.
void shorten_moves_of_tetrahedra(Clipped& body, const Grid& grid);

}  // namespace palpate
