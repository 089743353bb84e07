// K and D of a locally refined body (refined_body.hpp), assembled from those of its elements. With K and D the symmetric tangents
// of its forces F (dynamics.hpp) and T the map from its coordinates y to its nodes:
//
//     K_y = T^T K T = sum_e T_e^T k_e T_e,     D_y = T^T D T = sum_e T_e^T d_e T_e + c M_y
//
// k_e, d_e the tangents of element e (element_subset.hpp), c [1/s] the body's mass-proportional damping (solids only). T_e is the
// motion of its nodes: a near node moves by itself; the far ones all move with the corners q of one cell, by N_q (far_field.hpp).
// That cell is, if e has a near node, the far cell that has most of its nodes; else its home. So e joins near nodes and the
// corners of one cell: with A_ab the sum over the elements of such a cell between nodes a and b (ElementSubset),
//
//     a, b near:  A_ab to (a, b)      a near, b far:  N_q(b) A_ab to (a, q)      a, b far:  N_p(a) N_q(b) A_ab to (p, q)
//
// The pattern has an entry (p, q) if an element joins two near nodes p and q, or a near node p and a far cell with the corner q,
// or if p and q are corners of one far cell.
//
// Shapes: n coordinates of three numbers; K_y, D_y 3 n x 3 n, symmetric, the upper triangle stored in 3 x 3 blocks [N/m],
// [N s/m]; y, k_y = K_y y and d_y = D_y y 3 n x m.
// Limits: K_y is not definite where a compressed body softens, and a = c_d D_y + c_k K_y may not be either; `clamp` drops the
// softening of elements with a near node only. For far nodes of e in other cells its N is extrapolated beyond the cell, which
// differs slightly from their motion (T). Elements between far nodes may be linearised at an earlier state (far_tangents.hpp).
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/elements/spring_forces.hpp"
#include "server/operators/far_tangents.hpp"

namespace palpate {

class RefinedBody;

/// The pattern of these matrices, from the pairs that elements with near nodes join, and the entries of the corners in it.
class RefinedPattern {
 public:
  /// A near node and a far cell that an element joins.
  using Border = std::pair<std::uint32_t, std::uint32_t>;  // coordinate, cell
  using Pair = std::pair<std::uint32_t, std::uint32_t>;    // coordinates

  RefinedPattern() = default;
  RefinedPattern(const RefinedBody& body, std::vector<Pair> near_pairs, std::vector<Border> borders);

  const BlockPattern& pattern() const { return pattern_; }
  std::uint32_t entry(std::uint32_t p, std::uint32_t q) const { return pattern_.find(std::min(p, q), std::max(p, q)); }
  /// Returns the index of a border among all.
  std::uint32_t border(const Border& border) const;
  /// Returns the entries of a border's near node with the corners of its cell.
  std::span<const std::uint32_t, FarField::kCorners> of_border(std::uint32_t border) const {
    return std::span<const std::uint32_t, FarField::kCorners>(&border_entries_[FarField::kCorners * border], FarField::kCorners);
  }
  /// Returns the entries of the pairs of corners of a far cell.
  std::span<const std::uint32_t, kCornerPairs> of_corners(std::uint32_t cell) const {
    return std::span<const std::uint32_t, kCornerPairs>(&corner_entries_[kCornerPairs * cell], kCornerPairs);
  }

 private:
  BlockPattern pattern_;
  std::vector<Border> borders_;
  std::vector<std::uint32_t> border_entries_, corner_entries_;
};

class RefinedTangents {
 public:
  /// `body` must outlive it.
  explicit RefinedTangents(const RefinedBody& body);

  /// Must be called when the body's coordinates have changed.
  void lay_out();
  /// Linearises at this state.
  void take(const BodyState& state);
  /// Returns the forces of all elements on all nodes at a state [N], in single precision.
  const NodeArrays& forces(const BodyState& state);
  /// Returns the elements with a near node.
  std::vector<std::uint32_t> near_elements() const;
  /// Pattern of the upper triangle.
  const BlockPattern& pattern() const { return tangents_.pattern(); }
  /// Assembles a = c_d D + c_k K; `clamp`: as Dynamics::assemble, for elements with a near node.
  void assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const;
  void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const { tangents_.multiply(y, k_y, d_y); }
  void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const { tangents_.multiply_sum(y, c_k, c_d, sum); }

 private:
  using Pair = TangentMatrices::Pair;
  /// Elements whose nodes are near, or in the same far cell.
  struct Near {
    ElementSubset subset;
    std::uint32_t cell;                   // kNone: all are near
    std::vector<std::uint32_t> rows;      // coordinates of its nodes; kNone for far ones
    std::vector<FarField::Shape> shapes;  // in the cell; zero for near nodes
    std::vector<std::uint32_t> places;    // per link: the entry between near nodes, or the border; unused for far ones
  };
  std::uint32_t far_home(std::span<const std::uint32_t> nodes) const;
  void take_near();
  void find_places(Near& near) const;
  void add_far(TangentMatrices& to) const;
  /// Adds the elements of near_, and contacts with rigid parts.
  void add_near(bool clamp, TangentMatrices& to) const;
  /// `contact` is with a rigid part.
  void add_contact(const Contacts::Block& contact, TangentMatrices& to) const;
  void add_to_corners(std::uint32_t cell, const CornerTangent& tangent, TangentMatrices& to) const;
  /// Adds a block with the rows of coordinate p and the columns of q.
  static void add(const Pair& pair, std::uint32_t p, std::uint32_t q, std::uint32_t entry, TangentMatrices& to);

  const RefinedBody* body_;
  FarTangents far_;
  std::optional<SpringForces> springs_;
  NodeArrays forces_;  // of a solid
  RefinedPattern pattern_;
  TangentMatrices tangents_;
  std::vector<Near> near_;
  const BodyState* state_ = nullptr;
};

}  // namespace palpate
