#include "server/operators/refined_tangents.hpp"

#include <algorithm>
#include <cassert>
#include <map>

#include "server/operators/local_body.hpp"
#include "server/operators/refined_body.hpp"

namespace palpate {

RefinedPattern::RefinedPattern(const RefinedBody& body, std::vector<Pair> near_pairs, std::vector<Border> borders)
    : borders_(std::move(borders)) {
  std::sort(borders_.begin(), borders_.end());
  borders_.erase(std::unique(borders_.begin(), borders_.end()), borders_.end());
  const FarField& far = body.far();
  std::vector<Pair> pairs = std::move(near_pairs);
  for (const auto& [row, cell] : borders_)
    for (const std::uint32_t corner : far.corners_of(cell)) pairs.emplace_back(row, body.corner(corner));
  const auto each_corner_pair = [&](std::uint32_t cell, const auto& visit) {
    const auto& corners = far.corners_of(cell);
    for (std::size_t p = 0; p < corners.size(); ++p)
      for (std::size_t q = p; q < corners.size(); ++q) visit(body.corner(corners[p]), body.corner(corners[q]));
  };
  for (std::uint32_t c = 0; c < far.cells(); ++c)
    if (!body.near()[c])
      each_corner_pair(c, [&](std::uint32_t p, std::uint32_t q) {
        if (p != q) pairs.emplace_back(p, q);
      });
  pattern_ = BlockPattern(body.size(), pairs, Triangles::upper);
  for (const auto& [row, cell] : borders_)
    for (const std::uint32_t corner : far.corners_of(cell)) border_entries_.push_back(entry(row, body.corner(corner)));
  corner_entries_.assign(kCornerPairs * far.cells(), RefinedBody::kNone);
  for (std::uint32_t c = 0; c < far.cells(); ++c) {
    if (body.near()[c]) continue;
    std::uint32_t* to = &corner_entries_[kCornerPairs * c];
    each_corner_pair(c, [&](std::uint32_t p, std::uint32_t q) { *to++ = entry(p, q); });
  }
}

std::uint32_t RefinedPattern::border(const Border& border) const {
  assert(std::binary_search(borders_.begin(), borders_.end(), border));
  return static_cast<std::uint32_t>(std::lower_bound(borders_.begin(), borders_.end(), border) - borders_.begin());
}

RefinedTangents::RefinedTangents(const RefinedBody& body)
    : body_(&body), far_(body.dynamics(), body.far()), forces_(body.dynamics().nodes()) {
  if (!body.dynamics().body().is_solid()) springs_.emplace(body.dynamics().body());
}

std::vector<std::uint32_t> RefinedTangents::near_elements() const { return far_.elements_at(body_->near()); }

const NodeArrays& RefinedTangents::forces(const BodyState& state) {
  if (springs_) return springs_->at(state.x, state.v);
  const Dynamics& dynamics = body_->dynamics();
  Vector f = Vector::Zero(state.x.size());
  dynamics.tetrahedra().add_forces(state.x, state.v, f);
  dynamics.hexahedra().add_forces(state.x, state.v, f);
  dynamics.relaxation().add_forces(state, f);
  if (state.traction) f += state.traction->at(state.time_s);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) forces_.set(i, at_node(f, i));
  return forces_;
}

void RefinedTangents::lay_out() {
  take_near();
  std::vector<RefinedPattern::Pair> pairs;
  std::vector<RefinedPattern::Border> borders;
  for (const Near& near : near_)
    for (const auto& [a, b] : near.subset.links()) {
      const std::uint32_t p = near.rows[a], q = near.rows[b];
      if (p != RefinedBody::kNone && q != RefinedBody::kNone && p != q) pairs.emplace_back(p, q);
      if ((p == RefinedBody::kNone) != (q == RefinedBody::kNone)) borders.emplace_back(std::min(p, q), near.cell);
    }
  pattern_ = RefinedPattern(*body_, std::move(pairs), std::move(borders));
  tangents_ = TangentMatrices(pattern_.pattern());
  for (Near& near : near_) find_places(near);
}

/// Returns the far cell that contains most of these nodes; none if none is far.
std::uint32_t RefinedTangents::far_home(std::span<const std::uint32_t> nodes) const {
  std::uint32_t home = RefinedBody::kNone;
  std::ptrdiff_t most = 0;
  for (const std::uint32_t i : nodes) {
    const std::uint32_t cell = body_->far().cell_of(i);
    if (body_->near()[cell]) continue;
    const std::ptrdiff_t here =
        std::count_if(nodes.begin(), nodes.end(), [&](std::uint32_t j) { return body_->far().cell_of(j) == cell; });
    if (here > most) home = cell;
    most = std::max(most, here);
  }
  return home;
}

void RefinedTangents::take_near() {
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_home;
  std::array<std::uint32_t, 2> scratch;
  for (const std::uint32_t e : near_elements()) by_home[far_home(nodes_of(body_->dynamics().body(), e, scratch))].push_back(e);
  near_.clear();
  for (const auto& [home, elements] : by_home) {
    Near& near = near_.emplace_back();
    near.subset = ElementSubset(body_->dynamics(), elements);
    near.cell = home;
    for (const std::uint32_t i : near.subset.nodes()) {
      near.rows.push_back(body_->coordinate(i));
      const bool is_far = near.rows.back() == RefinedBody::kNone;
      near.shapes.push_back(is_far ? body_->far().shape_in(i, home) : FarField::Shape(FarField::Shape::Zero()));
    }
  }
}

void RefinedTangents::find_places(Near& near) const {
  for (const auto& [a, b] : near.subset.links()) {
    const std::uint32_t p = near.rows[a], q = near.rows[b];
    if (p != RefinedBody::kNone && q != RefinedBody::kNone)
      near.places.push_back(pattern_.entry(p, q));
    else if (p != q)
      near.places.push_back(pattern_.border({std::min(p, q), near.cell}));
    else
      near.places.push_back(RefinedBody::kNone);
  }
}

void RefinedTangents::take(const BodyState& state) {
  state_ = &state;
  far_.take(state, body_->near());
  tangents_.set_zero();
  add_far(tangents_);
  add_near(false, tangents_);
}

void RefinedTangents::add(const Pair& pair, std::uint32_t p, std::uint32_t q, std::uint32_t entry, TangentMatrices& to) {
  if (p <= q)
    to.at(entry) += pair;
  else
    to.at(entry) += ElementSubset::transposed(pair);
}

void RefinedTangents::add_to_corners(std::uint32_t cell, const CornerTangent& tangent, TangentMatrices& to) const {
  const auto& corners = body_->far().corners_of(cell);
  const auto entries = pattern_.of_corners(cell);
  std::size_t k = 0;
  for (std::size_t p = 0; p < corners.size(); ++p)
    for (std::size_t q = p; q < corners.size(); ++q, ++k)
      add(tangent[k], body_->corner(corners[p]), body_->corner(corners[q]), entries[k], to);
}

void RefinedTangents::add_far(TangentMatrices& to) const {
  for (std::uint32_t c = 0; c < body_->far().cells(); ++c)
    if (!body_->near()[c]) add_to_corners(c, far_.tangent(c), to);
  const double rate_1_s = body_->dynamics().body().mass_damping_1_s;
  for (std::uint32_t row = 0; row < body_->size() && rate_1_s > 0; ++row)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      to.at(pattern_.pattern().diagonal(row))[9 + 4 * axis] +=
          rate_1_s * body_->masses()[3 * static_cast<Eigen::Index>(row) + axis];
}

void RefinedTangents::add_contact(const Contacts::Block& contact, TangentMatrices& to) const {
  assert(contact.nodes.size() == 1);  // RefinedBody::suits() no body with others
  const std::uint32_t node = contact.nodes.front().first;
  Pair pair;
  for (Eigen::Index n = 0; n < 9; ++n) {
    pair[n] = contact.stiffness(n / 3, n % 3);
    pair[9 + n] = contact.damping(n / 3, n % 3);
  }
  if (const std::uint32_t row = body_->coordinate(node); row != RefinedBody::kNone) {
    to.at(pattern_.pattern().diagonal(row)) += pair;
    return;
  }
  const FarField::Shape& n = body_->far().shape(node);
  CornerTangent at_corners;
  std::size_t k = 0;
  for (Eigen::Index p = 0; p < n.size(); ++p)
    for (Eigen::Index q = p; q < n.size(); ++q, ++k) at_corners[k] = n[p] * n[q] * pair;
  add_to_corners(body_->far().cell_of(node), at_corners, to);
}

void RefinedTangents::add_near(bool clamp, TangentMatrices& to) const {
  for (const Contacts::Block& contact : body_->dynamics().contacts().tangents(*state_)) add_contact(contact, to);
  for (const Near& near : near_) {
    const std::vector<Pair> sums = near.subset.sums(*state_, clamp);
    for (std::size_t k = 0; k < sums.size(); ++k) {
      const auto [a, b] = near.subset.links()[k];
      const std::uint32_t p = near.rows[a], q = near.rows[b];
      if (p != RefinedBody::kNone && q != RefinedBody::kNone) {
        add(sums[k], p, q, near.places[k], to);
      } else if (p != q) {
        const bool a_is_near = p != RefinedBody::kNone;
        const Pair from_near = a_is_near ? sums[k] : ElementSubset::transposed(sums[k]);
        const FarField::Shape& n = near.shapes[a_is_near ? b : a];
        const auto entries = pattern_.of_border(near.places[k]);
        for (std::size_t c = 0; c < entries.size(); ++c)
          add(n[static_cast<Eigen::Index>(c)] * from_near, std::min(p, q), body_->corner(body_->far().corners_of(near.cell)[c]),
              entries[c], to);
      }
    }
    if (near.cell == RefinedBody::kNone) continue;
    CornerTangent at_corners;
    for (Pair& pair : at_corners) pair.setZero();
    add_over_corners(near.subset, sums, near.shapes, at_corners);
    add_to_corners(near.cell, at_corners, to);
  }
}

void RefinedTangents::assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const {
  if (!clamp) {
    tangents_.assemble(c_d, c_k, a);
    return;
  }
  TangentMatrices clamped(pattern_.pattern());
  clamped.set_zero();
  add_far(clamped);
  add_near(true, clamped);
  clamped.assemble(c_d, c_k, a);
}

}  // namespace palpate
