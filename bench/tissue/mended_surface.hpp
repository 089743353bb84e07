// A closed surface as scenes read it (server/scene/mesh_file.hpp), repaired, in its own units.
#pragma once

#include <string>

#include "server/scene/surface_file.hpp"

namespace palpate {

struct MendedSurface {
  TriangleMesh mesh;
  double across = 0;      ///< longest side of the box around it
  double volume = 0;      ///< of the solid: where the generalised winding number is above a half
  std::size_t inner = 0;  ///< shells within the solid that bound no hollow, left out
  double skin_share = 0;  ///< of the volume that the skin encloses; 0 without one
  double metres = 1;      ///< a unit, of those that people draw in, with which it is nearest in size to an organ
  const char* unit = "";  ///< the name of that unit
};

/// Reads and repairs `file`. Throws InputError as scenes do, except for the size.
/// edge: of the mesh to be made, in the surface's units; refused outside 1/100 to 1/2 of the longest side; 0: none.
/// skin: the surface of a lattice of that spacing, cut and moved to the solid's, in its place, which never crosses itself.
MendedSurface mended_surface(const std::string& file, double edge, bool skin);

}  // namespace palpate
