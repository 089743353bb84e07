// What of a body is far from all tools, on a coarse grid: it moves as the corners of the grid's cells do,
//
//     node i in cell c:   dx_i = sum_k N_k(X_i) u_k,     k the eight corners of c, N_k trilinear in the rest position X_i
//
// and fixed nodes do not move. What holds it together is in far_tangents.hpp.
//
// The grid is over the box around the body at rest; its edge is the smallest, from the mean edge of elements on, with which
// no more cells hold nodes than one for each kNodesACell (of solids kNodesASolidCell) nodes, nor than kCellsMax. How far a cell
// was bent or turned since, relative to its edge:
//
//     max_k |m_k - mean m| / min edge,     m_k how far the node moved that is furthest out in octant k
//
// Shapes: u_k, X_i, m_k 3 [m]; N eight numbers with sum 1, zero for a fixed node.
//
// Nodes of a cell move together even where the body has a gap between them. Cells of a solid that is nearly incompressible are
// too stiff when they are large, as with any coarse Galerkin projection.
//
// Source: shapes of a grid that does not follow the body, over its own fine elements: composite finite elements, Hackbusch and
// Sauter, Numer. Math. 75 (1997).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/body/dynamics.hpp"

namespace palpate {

class FarField {
 public:
  static constexpr std::size_t kCorners = 8;  ///< of a cell
  /// On average, or more where that makes more than kCellsMax. Cells of finite elements that hardly change their volume are too
  /// stiff when they are large: 27 nodes cost 1.4 dB; of springs 64 and 125 are as good (docs/notebook.md, 14).
  static constexpr std::size_t kNodesACell = 27, kNodesASolidCell = 8;
  static constexpr std::size_t kCellsMax = 400;  ///< keeps what a patch costs from growing with the body

  /// The body at rest; `dynamics` must outlive it.
  explicit FarField(const Dynamics& dynamics);

  using Shape = Eigen::Array<double, kCorners, 1>;
  std::uint32_t cells() const { return static_cast<std::uint32_t>(cells_.size()); }
  std::uint32_t corners() const { return corners_; }
  const Vec3& centre(std::uint32_t cell) const { return cells_[cell].centre; }
  double spacing_m() const;  ///< of nodes, on average
  const std::array<std::uint32_t, kCorners>& corners_of(std::uint32_t cell) const { return cells_[cell].corners; }
  /// Where corner k of a cell is.
  Vec3 corner(std::uint32_t cell, std::size_t k) const;
  const std::vector<std::uint32_t>& nodes_of(std::uint32_t cell) const { return cells_[cell].nodes; }
  std::uint32_t cell_of(std::uint32_t node) const { return cell_of_[node]; }
  /// N of a node in its own cell; zero for a fixed one.
  const Shape& shape(std::uint32_t node) const { return shapes_[node]; }
  /// N of a node in any cell, continued beyond it.
  Shape shape_in(std::uint32_t node, std::uint32_t cell) const;
  /// sum_i m_i N(X_i) over a cell's nodes [kg]
  const Shape& masses(std::uint32_t cell) const { return cells_[cell].masses; }
  /// The cell that holds the middle of these nodes at rest, or is nearest to it, of those that hold one of them.
  std::uint32_t home(std::span<const std::uint32_t> nodes) const;

  /// Where the nodes are that tell how a cell is bent.
  using Samples = std::array<Vec3, kCorners>;
  Samples samples(std::uint32_t cell, const Vector& x) const;
  /// How far they moved to each other, of the edge of a cell.
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
