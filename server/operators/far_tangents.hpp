// K and D of the part of a body far from all tools, over the corners of the cells of far_field.hpp. With N the shape functions of
// the nodes of element e in its home cell (FarField::home(); N is extrapolated beyond it), k_e and d_e its tangents, a cell's
// matrices are
//
//     K_c = sum_e N^T k_e N,     D_c = sum_e N^T d_e N,     over the elements at home in c between nodes of far cells
//
// Shapes: N 3 n_e x 24 for an element of n_e nodes; K_c, D_c 24 x 24 [N/m], [N s/m], kept as the 36 pairs of corners p <= q.
//
// They are kept: far from a tool the tangents change little from frame to frame, so only the cells with the largest distortion
// since theirs were computed are renewed, up to kRenewedSpringsMax or kRenewedSolidsMax elements per frame. If more of the body
// moves at once, the others have outdated tangents for some frames. They are stored in parts, by the other cells that the
// elements reach: the near cells can change without computing any of them again.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/operators/element_subset.hpp"
#include "server/operators/far_field.hpp"

namespace palpate {

/// Pairs of corners of a cell: 00, 01 ... 07, 11 ... (rows of the first, columns of the second).
inline constexpr std::size_t kCornerPairs = FarField::kCorners * (FarField::kCorners + 1) / 2;
using CornerTangent = std::array<TangentMatrices::Pair, kCornerPairs>;

/// Adds N^T A N over the corners of a cell, A being the sums of a subset and N the shape functions of its nodes there.
void add_over_corners(const ElementSubset& elements, std::span<const TangentMatrices::Pair> sums,
                      std::span<const FarField::Shape> shapes, CornerTangent& to);

class FarTangents {
 public:
  /// distortion() up to which tangents are kept: always renewing them gains less than 0.3 dB (docs/notebook.md, 14).
  static constexpr double kKeptDistortionMax = 2e-3;
  /// Elements far from tools whose tangents are renewed in a frame: more: slower frames; fewer: older tangents.
  static constexpr std::size_t kRenewedSpringsMax = 6000, kRenewedSolidsMax = 1500;

  /// Linearised at the body's rest state; `field` must outlive it.
  FarTangents(const Dynamics& dynamics, const FarField& field);

  /// Returns the elements with a node in one of these cells (1 = selected), ascending.
  std::vector<std::uint32_t> elements_at(const std::vector<std::uint8_t>& cells) const;

  /// Sums the elements between nodes of far cells (`near`: 1 = near, per cell), and renews those with the largest distortion.
  void take(const BodyState& state, const std::vector<std::uint8_t>& near);
  const CornerTangent& tangent(std::uint32_t cell) const { return cells_[cell].tangent; }

 private:
  /// Elements of a cell that reach the same other cells.
  struct Part {
    std::vector<std::uint32_t> others;
    std::vector<std::uint32_t> elements;
    ElementSubset subset;
    std::vector<FarField::Shape> shapes;  // for its nodes
    CornerTangent tangent;
    bool is_far = false;  // when it was last summed
    bool ends_in(const std::vector<std::uint8_t>& cells) const {
      return std::any_of(others.begin(), others.end(), [&](std::uint32_t c) { return cells[c] != 0; });
    }
  };
  struct Cell {
    std::vector<Part> parts;
    std::size_t elements = 0;  // over all parts
    FarField::Samples then{};
    CornerTangent tangent;   // over the parts that reach only far cells
    bool is_summed = false;  // since they were computed
  };
  void assign();
  void renew(std::uint32_t cell, const BodyState& state);
  static void add_up(Cell& cell, const std::vector<std::uint8_t>& near);

  const Dynamics* dynamics_;
  const FarField* field_;
  std::vector<Cell> cells_;
};

}  // namespace palpate
