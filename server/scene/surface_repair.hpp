// Small faults of surfaces that people draw, mended: triangles that are there twice, triangles and shells that face the wrong
// way, small holes.
#pragma once

#include <string>

#include "server/scene/surface_file.hpp"

namespace palpate {

inline constexpr double kMostHole = 0.1;  ///< of the size of the surface: the largest hole that is closed, measured around it
inline constexpr std::size_t kMostShells = 1'000;

/// What was mended.
struct SurfaceRepairs {
  std::size_t shells = 0;  ///< parts of the surface that share no edge
  std::size_t doubled = 0, holes = 0;
  std::size_t turned = 0;         ///< triangles that faced against those beside them
  std::size_t turned_shells = 0;  ///< that were inside out, and are no cavity of another
  /// Of all that was mended, empty where nothing was.
  std::string in_words() const;
};

/// Vertices at the same place are one. What cannot be mended stays as it is, for check_edges() (surface.hpp). Shells beyond
/// kMostShells are counted and not turned.
SurfaceRepairs repair_surface(TriangleMesh& mesh);

}  // namespace palpate
