// K and D of the part of a body far from all tools, over the corners of the cells of far_field.hpp. With N the shape functions of
// the nodes of element e in its home cell (FarField::home(); N is extrapolated beyond it), k_e and d_e its tangents, a cell's
// matrices are
//
//     K_c = sum_e N^T k_e N,     D_c = sum_e N^T d_e N,     over the elements at home in c between nodes of far cells
//
// Shapes: N 3 n_e x 24 for an element of n_e nodes; K_c, D_c 24 x 24 [N/m], [N s/m], kept as the 36 pairs of corners p <= q.
//
// They are kept: far from a tool the tangents change little from frame to frame, so only the cells with the largest distortion
// since theirs were computed are renewed, up to Bunch::kRenewedElementsMax elements per frame. If more of the body moves at once,
// the others have outdated tangents for some frames. They are stored in parts, by the other cells that the elements reach: the
// near cells can change without computing any of them again.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <span>
#include <vector>

#include "server/reduction/far_field.hpp"
#include "server/reduction/local_body.hpp"
#include "server/reduction/spring_subset.hpp"

namespace palpate {

/// Pairs of corners of a cell: 00, 01 ... 07, 11 ... (rows of the first, columns of the second).
inline constexpr std::size_t kCornerPairs = FarField::kCorners * (FarField::kCorners + 1) / 2;
template <int kNumbers>
using CornerTangent = std::array<typename TangentMatrices<kNumbers>::Pair, kCornerPairs>;

/// Adds N^T A N over the corners of a cell, A being the sums of a bunch and N the shape functions of its nodes there.
template <class Bunch>
void add_over_corners(const Bunch& bunch, std::span<const typename Bunch::Pair> sums, std::span<const FarField::Shape> shapes,
                      CornerTangent<Bunch::kNumbers>& to) {
  assert(sums.size() == bunch.links().size() && shapes.size() == bunch.nodes().size());
  using Pair = typename Bunch::Pair;
  std::vector<std::array<Pair, FarField::kCorners>> a_n(bunch.nodes().size());
  for (auto& row : a_n) row.fill(Pair::Zero());
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const auto [a, b] = bunch.links()[k];
    for (std::size_t q = 0; q < FarField::kCorners; ++q) a_n[a][q] += shapes[b][static_cast<Eigen::Index>(q)] * sums[k];
    if (a == b) continue;
    const Pair back = Bunch::transposed(sums[k]);
    for (std::size_t q = 0; q < FarField::kCorners; ++q) a_n[b][q] += shapes[a][static_cast<Eigen::Index>(q)] * back;
  }
  for (std::size_t i = 0; i < a_n.size(); ++i) {
    auto pair = to.begin();
    for (std::size_t p = 0; p < FarField::kCorners; ++p)
      for (std::size_t q = p; q < FarField::kCorners; ++q) *pair++ += shapes[i][static_cast<Eigen::Index>(p)] * a_n[i][q];
  }
}

/// `Bunch`: SpringSubset or SolidBunch.
template <class Bunch>
class FarTangents {
 public:
  /// distortion() up to which tangents are kept: always renewing them gains less than 0.3 dB (docs/notebook.md, 14).
  static constexpr double kKeptDistortionMax = 2e-3;
  using Tangent = CornerTangent<Bunch::kNumbers>;

  /// Linearised at the body's rest state; `field` must outlive it.
  FarTangents(const Dynamics& dynamics, const FarField& field) : dynamics_(&dynamics), field_(&field), cells_(field.cells()) {
    assign();
    const BodyState rest = dynamics.rest_state();
    for (std::uint32_t c = 0; c < cells_.size(); ++c) renew(c, rest);
  }

  /// Returns the elements with a node in one of these cells (1 = selected), ascending.
  std::vector<std::uint32_t> elements_at(const std::vector<std::uint8_t>& cells) const {
    std::vector<std::uint32_t> found;
    for (std::uint32_t c = 0; c < cells_.size(); ++c)
      for (const Part& part : cells_[c].parts)
        if (cells[c] || part.ends_in(cells)) found.insert(found.end(), part.elements.begin(), part.elements.end());
    std::sort(found.begin(), found.end());
    return found;
  }

  /// Sums the elements between nodes of far cells (`near`: 1 = near, per cell), and renews those with the largest distortion.
  void take(const BodyState& state, const std::vector<std::uint8_t>& near);
  const Tangent& tangent(std::uint32_t cell) const { return cells_[cell].tangent; }

 private:
  /// Elements of a cell that reach the same other cells.
  struct Part {
    std::vector<std::uint32_t> others;
    std::vector<std::uint32_t> elements;
    Bunch bunch;
    std::vector<FarField::Shape> shapes;  // for its nodes
    Tangent tangent;
    bool is_far = false;  // when it was last summed
    bool ends_in(const std::vector<std::uint8_t>& cells) const {
      return std::any_of(others.begin(), others.end(), [&](std::uint32_t c) { return cells[c] != 0; });
    }
  };
  struct Cell {
    std::vector<Part> parts;
    std::size_t elements = 0;  // over all parts
    FarField::Samples then{};
    Tangent tangent;         // over the parts that reach only far cells
    bool is_summed = false;  // since they were computed
  };
  void assign();
  void renew(std::uint32_t cell, const BodyState& state);
  static void add_up(Cell& cell, const std::vector<std::uint8_t>& near);
  static void clear(Tangent& tangent) {
    for (auto& pair : tangent) pair.setZero();
  }

  const Dynamics* dynamics_;
  const FarField* field_;
  std::vector<Cell> cells_;
};

template <class Bunch>
void FarTangents<Bunch>::assign() {
  std::array<std::uint32_t, 2> scratch;
  for (std::uint32_t e = 0; e < elements_of(dynamics_->body()); ++e) {
    const auto nodes = nodes_of(dynamics_->body(), e, scratch);
    const std::uint32_t home = field_->home(nodes);
    std::vector<std::uint32_t> others;
    for (const std::uint32_t i : nodes)
      if (field_->cell_of(i) != home) others.push_back(field_->cell_of(i));
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    Cell& cell = cells_[home];
    auto part = std::find_if(cell.parts.begin(), cell.parts.end(), [&](const Part& p) { return p.others == others; });
    if (part == cell.parts.end()) {
      part = cell.parts.emplace(part);
      part->others = std::move(others);
    }
    part->elements.push_back(e);
    ++cell.elements;
  }
  for (std::uint32_t c = 0; c < cells_.size(); ++c)
    for (Part& part : cells_[c].parts) {
      part.bunch = Bunch(*dynamics_, part.elements);
      for (const std::uint32_t i : part.bunch.nodes()) part.shapes.push_back(field_->shape_in(i, c));
    }
}

template <class Bunch>
void FarTangents<Bunch>::renew(std::uint32_t c, const BodyState& state) {
  Cell& cell = cells_[c];
  cell.then = field_->samples(c, state.x);
  cell.is_summed = false;
  for (Part& part : cell.parts) {
    clear(part.tangent);
    add_over_corners<Bunch>(part.bunch, part.bunch.sums(state, false), part.shapes, part.tangent);
  }
}

/// Sums the parts of a far cell that lie between far cells.
template <class Bunch>
void FarTangents<Bunch>::add_up(Cell& cell, const std::vector<std::uint8_t>& near) {
  const auto same = [&](const Part& part) { return part.is_far == !part.ends_in(near); };
  if (cell.is_summed && std::all_of(cell.parts.begin(), cell.parts.end(), same)) return;
  cell.is_summed = true;
  clear(cell.tangent);
  for (Part& part : cell.parts) {
    part.is_far = !part.ends_in(near);
    for (std::size_t k = 0; part.is_far && k < kCornerPairs; ++k) cell.tangent[k] += part.tangent[k];
  }
}

template <class Bunch>
void FarTangents<Bunch>::take(const BodyState& state, const std::vector<std::uint8_t>& near) {
  struct Old {
    double distortion;
    std::uint32_t cell;
  };
  std::vector<Old> old;
  for (std::uint32_t c = 0; c < cells_.size(); ++c)
    if (const double by = near[c] ? 0.0 : field_->distortion(cells_[c].then, field_->samples(c, state.x));
        by > kKeptDistortionMax)
      old.push_back({by, c});
  std::sort(old.begin(), old.end(), [](const Old& p, const Old& q) {
    return p.distortion != q.distortion ? p.distortion > q.distortion : p.cell < q.cell;
  });
  std::size_t renewed = 0;
  for (const Old& o : old) {
    if (renewed >= Bunch::kRenewedElementsMax) break;
    renew(o.cell, state);
    renewed += cells_[o.cell].elements;
  }
  for (std::uint32_t c = 0; c < cells_.size(); ++c)
    if (!near[c]) add_up(cells_[c], near);
}

}  // namespace palpate
