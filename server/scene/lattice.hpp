// Builds a lumped body from the settings of a lattice.
//
// Every node is joined by one element to each of its lateral and diagonal neighbours (8 in a sheet, 26 in 3-D) with which it
// shares a cell; the rest length is their distance at rest. The mass, density times volume, is divided equally among all nodes,
// fixed ones included. With `young_pa` springs and masses are those of cauchy_lattice.hpp. With `solid` every cell is a
// hexahedron or six tetrahedra instead, which give their mass to their own nodes. A layer comprises the elements whose midpoint
// lies in it; where layers overlap, the one listed later wins.
#pragma once

#include <vector>

#include "server/scene/grid.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

struct LatticeBody {
  LumpedBody body;
  Grid grid;
  std::vector<std::uint32_t> number;  ///< body node of every grid node, kNoNode if the clip removed it
};

/// Builds a lattice that is not clipped, from settings that need no file, as experiments do by the dozen.
LatticeBody build_box(const LatticeSettings& settings);

/// Throws InputError if the lattice cannot represent what the scene asks for; `text` supplies the lines.
LatticeBody build_lattice(const LatticeSettings& settings, const SceneText& text);

}  // namespace palpate
