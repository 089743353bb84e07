// Interface to K and D of a locally refined body (refined_body.hpp) of any elements, and the pattern of these matrices. With K
// and D the symmetric tangents of its forces F (dynamics.hpp) and T the map from its coordinates y to its nodes:
//
//     K_y = T^T K T,   K = -dF/dx,      D_y = T^T D T,   D = -dF/dv        (refined_elements.hpp: element by element)
//
// The pattern has an entry (p, q) if an element joins two near nodes p and q, or a near node p and a far cell with the corner q,
// or if p and q are corners of one far cell.
//
// Shapes: n coordinates of three numbers; K_y, D_y 3 n x 3 n, symmetric, the upper triangle stored in 3 x 3 blocks [N/m],
// [N s/m]; y, k_y = K_y y and d_y = D_y y 3 n x m.
// Limits: K_y is not definite where a compressed body softens, and a = c_d D_y + c_k K_y may not be either; `clamp` drops the
// softening of elements with a near node only. Elements between far nodes may be linearised at an earlier state
// (far_tangents.hpp).
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/elements/spring_blocks.hpp"
#include "server/reduction/far_tangents.hpp"

namespace palpate {

class RefinedBody;

class RefinedTangents {
 public:
  virtual ~RefinedTangents() = default;
  /// Must be called when the body's coordinates have changed.
  virtual void lay_out() = 0;
  /// Linearises at this state.
  virtual void take(const BodyState& state) = 0;
  /// Returns the forces of all elements on all nodes at a state [N].
  virtual const NodeArrays& forces(const BodyState& state) = 0;
  /// Elements with a near node.
  virtual std::vector<std::uint32_t> near_elements() const = 0;
  /// Pattern of the upper triangle.
  virtual const BlockPattern& pattern() const = 0;
  /// Assembles a = c_d D + c_k K; `clamp`: as Dynamics::assemble, for elements with a near node.
  virtual void assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const = 0;
  virtual void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const = 0;
  virtual void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const = 0;
};

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

}  // namespace palpate
