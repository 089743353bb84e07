// From settings to a lumped body.
//
// Every node joins all its lateral and diagonal neighbours (8 in a sheet, 26 in 3-D) with which it shares a cell, by one element
// whose rest length is the distance of the two at rest. The mass, density times volume, is shared equally by all nodes, fixed
// ones included. With `young_pa` springs and masses are those of cauchy_lattice.hpp. With `solid` every cell is a hexahedron or
// six tetrahedra instead, each of which gives its mass to its nodes. A layer takes the elements whose midpoint lies in it; where
// layers overlap, the one that is listed later wins.
#pragma once

#include <vector>

#include "server/scene/grid.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

struct LatticeBody {
  LumpedBody body;
  Grid grid;
  std::vector<std::uint32_t> number;  ///< body node of every grid node, kNoNode where the clip took it away
};

/// A lattice that is not clipped, of settings that need no file: what experiments build by the dozen.
LatticeBody build_box(const LatticeSettings& settings);

/// Throws InputError when the lattice cannot carry what the scene asks for; `text` supplies the lines.
LatticeBody build_lattice(const LatticeSettings& settings, const SceneText& text);

}  // namespace palpate
