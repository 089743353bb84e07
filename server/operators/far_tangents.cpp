#include "server/operators/far_tangents.hpp"

#include <cassert>

#include "server/operators/local_body.hpp"

namespace palpate {
namespace {

void clear(CornerTangent& tangent) {
  for (auto& pair : tangent) pair.setZero();
}

}  // namespace

void add_over_corners(const ElementSubset& elements, std::span<const TangentMatrices::Pair> sums,
                      std::span<const FarField::Shape> shapes, CornerTangent& to) {
  assert(sums.size() == elements.links().size() && shapes.size() == elements.nodes().size());
  using Pair = TangentMatrices::Pair;
  std::vector<std::array<Pair, FarField::kCorners>> a_n(elements.nodes().size());
  for (auto& row : a_n) row.fill(Pair::Zero());
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const auto [a, b] = elements.links()[k];
    for (std::size_t q = 0; q < FarField::kCorners; ++q) a_n[a][q] += shapes[b][static_cast<Eigen::Index>(q)] * sums[k];
    if (a == b) continue;
    const Pair back = ElementSubset::transposed(sums[k]);
    for (std::size_t q = 0; q < FarField::kCorners; ++q) a_n[b][q] += shapes[a][static_cast<Eigen::Index>(q)] * back;
  }
  for (std::size_t i = 0; i < a_n.size(); ++i) {
    auto pair = to.begin();
    for (std::size_t p = 0; p < FarField::kCorners; ++p)
      for (std::size_t q = p; q < FarField::kCorners; ++q) *pair++ += shapes[i][static_cast<Eigen::Index>(p)] * a_n[i][q];
  }
}

FarTangents::FarTangents(const Dynamics& dynamics, const FarField& field)
    : dynamics_(&dynamics), field_(&field), cells_(field.cells()) {
  assign();
  const BodyState rest = dynamics.rest_state();
  for (std::uint32_t c = 0; c < cells_.size(); ++c) renew(c, rest);
}

std::vector<std::uint32_t> FarTangents::elements_at(const std::vector<std::uint8_t>& cells) const {
  std::vector<std::uint32_t> found;
  for (std::uint32_t c = 0; c < cells_.size(); ++c)
    for (const Part& part : cells_[c].parts)
      if (cells[c] || part.ends_in(cells)) found.insert(found.end(), part.elements.begin(), part.elements.end());
  std::sort(found.begin(), found.end());
  return found;
}

void FarTangents::assign() {
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
      part.subset = ElementSubset(*dynamics_, part.elements);
      for (const std::uint32_t i : part.subset.nodes()) part.shapes.push_back(field_->shape_in(i, c));
    }
}

void FarTangents::renew(std::uint32_t c, const BodyState& state) {
  Cell& cell = cells_[c];
  cell.then = field_->samples(c, state.x);
  cell.is_summed = false;
  for (Part& part : cell.parts) {
    clear(part.tangent);
    add_over_corners(part.subset, part.subset.sums(state, false), part.shapes, part.tangent);
  }
}

/// Sums the parts of a far cell that lie between far cells.
void FarTangents::add_up(Cell& cell, const std::vector<std::uint8_t>& near) {
  const auto same = [&](const Part& part) { return part.is_far == !part.ends_in(near); };
  if (cell.is_summed && std::all_of(cell.parts.begin(), cell.parts.end(), same)) return;
  cell.is_summed = true;
  clear(cell.tangent);
  for (Part& part : cell.parts) {
    part.is_far = !part.ends_in(near);
    for (std::size_t k = 0; part.is_far && k < kCornerPairs; ++k) cell.tangent[k] += part.tangent[k];
  }
}

void FarTangents::take(const BodyState& state, const std::vector<std::uint8_t>& near) {
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
  const std::size_t most = dynamics_->body().is_solid() ? kRenewedSolidsMax : kRenewedSpringsMax;
  std::size_t renewed = 0;
  for (const Old& o : old) {
    if (renewed >= most) break;
    renew(o.cell, state);
    renewed += cells_[o.cell].elements;
  }
  for (std::uint32_t c = 0; c < cells_.size(); ++c)
    if (!near[c]) add_up(cells_[c], near);
}

}  // namespace palpate
