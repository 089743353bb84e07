// The solids of the paper's sections 6 and 7, built in code so that its experiments need no further files.
//
// Section 6 has a 6x6x6 lumped-element model and prints nothing else about it. Here: a 0.1 m cube of water's density, bottom face
// fixed, every node joined to its 26 neighbours by k = 60 N/m and b = 0.24 N s/m: the body of scenes/cube6.json, lowest modes at
// 5.5 to 6.3 Hz with 7 % damping. Section 7 names bodies on which its local models must fail; they are that cube with
//     soft_below   everything under z = 0.06 m softer than above ("deep tissue significantly more compliant than the surface")
//     stiff_inside a lump of 2 x 2 x 2 cells in the middle of the body, stiffer than the rest
//     stiff_at_top the same lump under the tool, its top at the surface
//     torn         one layer of cells, two below the surface, softer than the rest: a healing tear, a discontinuity
// each with a ratio of stiff to soft springs; dampers keep b / k. Source: Cavusoglu and Tendick, sections 6 and 7.
#pragma once

#include <array>
#include <string_view>

#include "server/scene/scene.hpp"

namespace palpate {

inline constexpr double kPaperCubeM = 0.1;

/// The cube, grasped at node (2, 2, 5), on top, or touched. With another width than the cube's it is a block of its cells, as
/// high as the cube: `width_m` is a multiple of 20 mm.
Scene paper_cube(ContactKind contact, double width_m = kPaperCubeM);
/// The same nodes, filled with tetrahedra of a stable neo-Hookean solid of 10 kPa, Poisson's ratio 0.45, damped alike.
Scene solid_cube(ContactKind contact, double width_m = kPaperCubeM);

enum class Flaw { soft_below, stiff_inside, stiff_at_top, torn };
inline constexpr std::array<std::string_view, 4> kFlawNames{"soft below", "stiff inside", "stiff at top", "torn"};
inline std::string_view name_of(Flaw flaw) { return kFlawNames[static_cast<std::size_t>(flaw)]; }

/// A flawed cube, grasped. A `ratio` of 1 is a homogeneous cube: of 60 N/m, for soft_below of 120 N/m (scenes/softcore6.json has
/// ratio 6).
Scene flawed_cube(Flaw flaw, double ratio);

}  // namespace palpate
