// K and D of a locally refined body (refined_body.hpp), whatever it is made of, and where in them what goes. With K and D the
// symmetric tangents of its forces F (dynamics.hpp) and T how its nodes move with its coordinates y:
//
//     K_y = T^T K T,   K = -dF/dx,      D_y = T^T D T,   D = -dF/dv        (refined_elements.hpp: element by element)
//
// An entry (p, q) of the pattern is there where an element joins two near nodes p and q, a near node p and a far cell with the
// corner q, or where p and q are corners of one far cell.
//
// Shapes: n coordinates of three numbers; K_y, D_y 3 n x 3 n, symmetric, the upper triangle kept in 3 x 3 blocks [N/m],
// [N s/m]; y, k_y = K_y y and d_y = D_y y 3 n x m.
// What can go wrong: K_y is not definite where a compressed body softens, nor need a = c_d D_y + c_k K_y be; `clamp` leaves
// that out of elements with a near node alone. Those between far nodes may be of an earlier state (far_tangents.hpp).
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/body/spring_blocks.hpp"
#include "server/reduce/far_tangents.hpp"

namespace palpate {

class RefinedBody;

class RefinedTangents {
 public:
  virtual ~RefinedTangents() = default;
  /// The body's coordinates are others from here on.
  virtual void lay_out() = 0;
  /// From here on at this state.
  virtual void take(const BodyState& state) = 0;
  /// Of all elements on all nodes at a state [N].
  virtual const NodeArrays& forces(const BodyState& state) = 0;
  /// Elements with a near node.
  virtual std::vector<std::uint32_t> near_elements() const = 0;
  /// Of the upper triangle.
  virtual const BlockPattern& pattern() const = 0;
  /// a = c_d D + c_k K; `clamp`: as Dynamics::assemble, of elements with a near node.
  virtual void assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const = 0;
  virtual void multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const = 0;
  virtual void multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const = 0;
};

/// The pattern of these matrices, from what the elements with near nodes join, and where in it the corners are.
class RefinedPattern {
 public:
  /// A near node and a far cell that an element joins.
  using Border = std::pair<std::uint32_t, std::uint32_t>;  // coordinate, cell
  using Pair = std::pair<std::uint32_t, std::uint32_t>;    // coordinates

  RefinedPattern() = default;
  RefinedPattern(const RefinedBody& body, std::vector<Pair> near_pairs, std::vector<Border> borders);

  const BlockPattern& pattern() const { return pattern_; }
  std::uint32_t entry(std::uint32_t p, std::uint32_t q) const { return pattern_.find(std::min(p, q), std::max(p, q)); }
  /// Where a border is among all.
  std::uint32_t border(const Border& border) const;
  /// The entries of its near node and the corners of its cell.
  std::span<const std::uint32_t, FarField::kCorners> of_border(std::uint32_t border) const {
    return std::span<const std::uint32_t, FarField::kCorners>(&border_entries_[FarField::kCorners * border], FarField::kCorners);
  }
  /// The entries of the pairs of corners of a far cell.
  std::span<const std::uint32_t, kCornerPairs> of_corners(std::uint32_t cell) const {
    return std::span<const std::uint32_t, kCornerPairs>(&corner_entries_[kCornerPairs * cell], kCornerPairs);
  }

 private:
  BlockPattern pattern_;
  std::vector<Border> borders_;
  std::vector<std::uint32_t> border_entries_, corner_entries_;
};

}  // namespace palpate
