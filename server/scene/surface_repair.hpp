// Repairs small faults of hand-made surfaces: duplicate triangles, walls without thickness, triangles and shells with the wrong
// orientation, small holes.
#pragma once

#include <string>

#include "server/scene/surface_file.hpp"

namespace palpate {

inline constexpr double kMostHole = 0.1;  ///< largest hole that is closed, by its circumference over the size of the surface
inline constexpr std::size_t kMostShells = 1'000;

/// Repairs that were made.
struct SurfaceRepairs {
  std::size_t shells = 0;  ///< parts of the surface that share no edge
  std::size_t doubled = 0, holes = 0;
  std::size_t walls = 0;          ///< triangles left out because they face each other in one place
  std::size_t turned = 0;         ///< triangles that were oriented against their neighbours
  std::size_t turned_shells = 0;  ///< shells that were inside out, and are no cavity of another
  /// Describes all repairs; empty if there was none.
  std::string in_words() const;
};

/// Merges vertices at the same position and repairs what it can. The rest stays as it is, for check_edges() (surface.hpp). Shells
/// beyond kMostShells are counted but not reoriented.
SurfaceRepairs repair_surface(TriangleMesh& mesh);

/// Drops the shells of a repaired surface that have solid on both of their sides: those within others that bound no hollow.
/// Returns their number.
std::size_t drop_inner_shells(TriangleMesh& mesh);

}  // namespace palpate
