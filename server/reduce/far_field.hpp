// What of a body of springs is far from all tools, on a coarse grid: it moves as the corners of the grid's cells do,
//
//     node i in cell c:   dx_i = sum_k N_k(X_i) u_k,     k the eight corners of c, N_k trilinear in the rest position X_i
//
// and fixed nodes do not move. For a spring between nodes a and b, w_k = N_k(X_a) - N_k(X_b) in the cell that holds its middle
// (if that is a's or b's; else a's: N is continued beyond the cell), a cell's matrices are
//
//     K_c = sum_e w_e w_e^T (x) k_e,     D_c = sum_e w_e w_e^T (x) d_e,     k_e, d_e: tangents of element_kernel.hpp
//
// They are kept: far from a tool the tangents change little from frame to frame, so only the cells that were bent most since
// theirs were made get new ones, as many as kSpringsAFrame allow. They are kept in parts, by the cell that the springs end in:
// what is near can change without any of them being made again.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/reduce/spring_matrices.hpp"

namespace palpate {

class FarField {
 public:
  static constexpr std::size_t kCorners = 8;
  static constexpr std::size_t kNodesACell = 27;  ///< on average, or more where that makes more than
  static constexpr std::size_t kCellsMost = 400;
  static constexpr std::size_t kSpringsAFrame = 6000;
  static constexpr double kBent = 2e-3;  ///< of the edge of a cell, that its nodes moved to each other

  /// The body at rest; `dynamics` must outlive it.
  explicit FarField(const Dynamics& dynamics);

  using Shape = Eigen::Array<double, kCorners, 1>;
  static constexpr std::size_t kPairs = kCorners * (kCorners + 1) / 2;  ///< of corners: 00, 01 ... 07, 11 ...
  using Tangent = std::array<SpringMatrices::Pair, kPairs>;             ///< symmetric in the corners
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
  /// sum_i m_i N(X_i) over a cell's nodes [kg]
  const Shape& masses(std::uint32_t cell) const { return cells_[cell].masses; }
  /// The springs that have a node in such a cell (1 = one of them), ascending.
  std::vector<std::uint32_t> springs_at(const std::vector<std::uint8_t>& cells) const;

  /// Tangents for the springs between nodes of far cells, `near` the others (1 = near, per cell), new ones where the body was
  /// bent most.
  void take(const BodyState& state, const std::vector<std::uint8_t>& near);
  const Tangent& tangent(std::uint32_t cell) const { return cells_[cell].tangent; }

 private:
  /// Springs of a cell that end in the same one.
  struct Part {
    std::uint32_t to = 0;  // that cell: another, or the same
    std::vector<std::uint32_t> springs;
    Tangent tangent;
    bool is_far = false;  // then
  };
  struct Cell {
    Vec3 centre = Vec3::Zero();
    std::array<std::uint32_t, kCorners> corners{};
    std::vector<std::uint32_t> nodes;
    std::vector<Part> parts;
    std::size_t springs = 0;                        // of all parts
    std::array<std::uint32_t, kCorners> samples{};  // nodes that tell how it is bent
    std::array<Vec3, kCorners> then{};
    Shape masses = Shape::Zero();
    Tangent tangent;         // of the parts that end in far cells
    bool is_summed = false;  // since they were made
  };
  void divide();
  void assign_springs();
  Shape shape_in(std::uint32_t node, std::uint32_t cell) const;
  double bent(const Cell& cell, const Vector& x) const;
  void renew(std::uint32_t cell, const BodyState& state);
  static void add_up(Cell& cell, const std::vector<std::uint8_t>& near);

  const Dynamics* dynamics_;
  Vec3 edge_ = Vec3::Zero(), per_edge_ = Vec3::Zero();
  std::uint32_t corners_ = 0;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> cell_of_;
  std::vector<Shape> shapes_;  // of each node
};

}  // namespace palpate
