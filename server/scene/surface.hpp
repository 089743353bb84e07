// Triangulated surfaces: the outside of a set of cells, and checks that every closed surface must pass.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/patch/patch.hpp"
#include "server/scene/grid.hpp"

namespace palpate {

/// A face between a cell of the set and the outside, corners counter-clockwise seen from outside.
struct BoundaryFace {
  std::array<std::uint32_t, 4> corners;  ///< node numbers
  bool odd = false;                      ///< chequerboard colour: selects the diagonal that splits the face
  std::int8_t wall = -1;                 ///< axis normal to the face if it lies on the outside of the grid, else -1
};

/// All boundary faces; `number` maps a grid node to its number in the body.
std::vector<BoundaryFace> boundary_faces(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number);

/// Returns two triangles per face. Neighbours are split along alternate diagonals, so that a symmetric body keeps a symmetric
/// surface.
std::vector<Triangle> split_alternately(std::span<const BoundaryFace> faces);
/// Returns two triangles per face, split along the shorter diagonal.
std::vector<Triangle> split_shorter(std::span<const BoundaryFace> faces, std::span<const Vec3> x);

/// Volume inside a closed surface by the divergence theorem [m^3]; negative if the triangles face inwards.
double signed_volume(std::span<const Triangle> triangles, std::span<const Vec3> x);

/// Faults in the closure of a surface. A directed edge a -> b is matched when b -> a occurs, and each occurs once.
struct EdgeReport {
  std::size_t open = 0;                    ///< edges with one triangle
  std::size_t shared = 0;                  ///< edges with four triangles or more, as many each way: where solids touch
  std::size_t crowded = 0;                 ///< other edges with three triangles or more
  std::size_t flipped = 0;                 ///< edges whose two triangles run the same way
  std::array<std::uint32_t, 2> example{};  ///< ends of one such edge, in the order of the list above
  /// Returns true for the boundary of a solid, whose winding number is whole everywhere beside it.
  bool bounds() const { return open + crowded + flipped == 0; }
  /// Returns true for a boundary with two triangles at every edge.
  bool closed() const { return bounds() && shared == 0; }
};
EdgeReport check_edges(std::span<const Triangle> triangles);

}  // namespace palpate
