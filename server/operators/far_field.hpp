// The part of a body that is far from all tools, on a coarse grid: its nodes move with the corners of the grid's cells,
//
//     node i in cell c:   dx_i = sum_k N_k(X_i) u_k,     k the eight corners of c, N_k trilinear in the rest position X_i
//
// and fixed nodes do not move. Its tangents are in far_tangents.hpp.
//
// The grid covers the bounding box of the body at rest; its edge is the smallest, starting at the mean edge of elements, such
// that the number of cells with nodes is at most one per kNodesACell nodes (for solids kNodesASolidCell) and at most kCellsMax.
// The distortion of a cell since an earlier state, relative to its edge, is
//
//     max_k |m_k - mean m| / min edge,     m_k the displacement of the outermost node in octant k
//
// Shapes: u_k, X_i, m_k 3 [m]; N eight numbers with sum 1, zero for a fixed node.
//
// Nodes of a cell move together even across a gap in the body. Large cells of a nearly incompressible solid are too stiff, as
// with any coarse Galerkin projection.
//
// Source: shape functions of a grid that does not follow the body, over its own fine elements: composite finite elements,
// Hackbusch and Sauter, Numer. Math. 75 (1997).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/body/dynamics.hpp"

namespace palpate {

class FarField {
 public:
  static constexpr std::size_t kCorners = 8;  ///< per cell
  /// Least number of nodes per cell on average, more if there would be more than kCellsMax cells. Large cells of nearly
  /// incompressible finite elements are too stiff: 27 nodes cost 1.4 dB; for springs 64 and 125 are as good (docs/notebook.md,
  /// 14).
  static constexpr std::size_t kNodesACell = 27, kNodesASolidCell = 8;
  static constexpr std::size_t kCellsMax = 400;  ///< limits the cost of a patch for large bodies

  /// The body is at rest; `dynamics` must outlive it.
  explicit FarField(const Dynamics& dynamics);

  using Shape = Eigen::Array<double, kCorners, 1>;
  std::uint32_t cells() const { return static_cast<std::uint32_t>(cells_.size()); }
  std::uint32_t corners() const { return corners_; }
  const Vec3& centre(std::uint32_t cell) const { return cells_[cell].centre; }
  double spacing_m() const;  ///< mean spacing of nodes
  const std::array<std::uint32_t, kCorners>& corners_of(std::uint32_t cell) const { return cells_[cell].corners; }
  /// Returns the position of corner k of a cell at rest.
  Vec3 corner(std::uint32_t cell, std::size_t k) const;
  const std::vector<std::uint32_t>& nodes_of(std::uint32_t cell) const { return cells_[cell].nodes; }
  std::uint32_t cell_of(std::uint32_t node) const { return cell_of_[node]; }
  /// Returns N of a node in its own cell; zero for a fixed one.
  const Shape& shape(std::uint32_t node) const { return shapes_[node]; }
  /// Returns N of a node in any cell, extrapolated beyond it.
  Shape shape_in(std::uint32_t node, std::uint32_t cell) const;
  /// Returns sum_i m_i N(X_i) over a cell's nodes [kg].
  const Shape& masses(std::uint32_t cell) const { return cells_[cell].masses; }
  /// Returns the cell that contains the mean of these nodes at rest, or is nearest to it, among the cells that contain one of
  /// them.
  std::uint32_t home(std::span<const std::uint32_t> nodes) const;

  /// Positions of the nodes from which the distortion of a cell is computed.
  using Samples = std::array<Vec3, kCorners>;
  Samples samples(std::uint32_t cell, const Vector& x) const;
  /// Returns their relative displacement, in edges of a cell.
  double distortion(const Samples& from, const Samples& to) const;

 private:
  struct Cell {
    Vec3 centre = Vec3::Zero();
    std::array<std::uint32_t, kCorners> corners{};
    std::vector<std::uint32_t> nodes;
    std::array<std::uint32_t, kCorners> samples{};
    Shape masses = Shape::Zero();
  };
  void divide();

  const Dynamics* dynamics_;
  Vec3 edge_ = Vec3::Zero(), per_edge_ = Vec3::Zero();
  std::uint32_t corners_ = 0;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> cell_of_;
  std::vector<Shape> shapes_;  // of each node
};

}  // namespace palpate
