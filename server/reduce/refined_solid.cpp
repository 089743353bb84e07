#include "server/reduce/refined_solid.hpp"

#include <algorithm>
#include <map>

namespace palpate {

RefinedSolid::RefinedSolid(const RefinedBody& body) : RefinedElements(body), f_(body.dynamics().nodes()) {}

void RefinedSolid::lay_out() {
  take_tetrahedra();
  std::vector<RefinedPattern::Pair> pairs;
  std::vector<RefinedPattern::Border> borders;
  for (const Near& near : near_)
    for (const auto& [a, b] : near.tetrahedra.links()) {
      const std::uint32_t p = near.rows[a], q = near.rows[b];
      if (p != RefinedBody::kNone && q != RefinedBody::kNone && p != q) pairs.emplace_back(p, q);
      if ((p == RefinedBody::kNone) != (q == RefinedBody::kNone)) borders.emplace_back(std::min(p, q), near.cell);
    }
  pattern_ = RefinedPattern(*body_, std::move(pairs), std::move(borders));
  tangents_ = SolidMatrices(pattern_.pattern());
  for (Near& near : near_) find_places(near);
}

/// Of the cells that the far ones of these nodes are in, the one with most of them; none where none is far.
std::uint32_t RefinedSolid::far_home(std::span<const std::uint32_t> nodes) const {
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

void RefinedSolid::take_tetrahedra() {
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_home;
  for (const std::uint32_t t : near_elements()) by_home[far_home(far_.elements().nodes_of(t))].push_back(t);
  near_.clear();
  for (const auto& [home, tetrahedra] : by_home) {
    Near& near = near_.emplace_back();
    near.tetrahedra = TetraBunch(body_->dynamics(), tetrahedra);
    near.cell = home;
    for (const std::uint32_t i : near.tetrahedra.nodes()) {
      near.rows.push_back(body_->coordinate(i));
      const bool is_far = near.rows.back() == RefinedBody::kNone;
      near.shapes.push_back(is_far ? body_->far().shape_in(i, home) : FarField::Shape(FarField::Shape::Zero()));
    }
  }
}

void RefinedSolid::find_places(Near& near) const {
  for (const auto& [a, b] : near.tetrahedra.links()) {
    const std::uint32_t p = near.rows[a], q = near.rows[b];
    if (p != RefinedBody::kNone && q != RefinedBody::kNone)
      near.places.push_back(pattern_.entry(p, q));
    else if (p != q)
      near.places.push_back(pattern_.border({std::min(p, q), near.cell}));
    else
      near.places.push_back(RefinedBody::kNone);
  }
}

void RefinedSolid::take(const BodyState& state) {
  x_ = state.x;
  far_.take(state, body_->near());
  tangents_.set_zero();
  add_far(tangents_);
  add_near(false, tangents_);
}

void RefinedSolid::add(const Pair& pair, std::uint32_t p, std::uint32_t q, std::uint32_t entry, SolidMatrices& to) {
  if (p <= q)
    to.at(entry) += pair;
  else
    to.at(entry) += TetraBunch::transposed(pair);
}

void RefinedSolid::add_to_corners(std::uint32_t cell, const CornerTangent<TetraBunch::kNumbers>& tangent,
                                  SolidMatrices& to) const {
  const auto& corners = body_->far().corners_of(cell);
  const auto entries = pattern_.of_corners(cell);
  std::size_t k = 0;
  for (std::size_t p = 0; p < corners.size(); ++p)
    for (std::size_t q = p; q < corners.size(); ++q, ++k)
      add(tangent[k], body_->corner(corners[p]), body_->corner(corners[q]), entries[k], to);
}

void RefinedSolid::add_far(SolidMatrices& to) const {
  for (std::uint32_t c = 0; c < body_->far().cells(); ++c)
    if (!body_->near()[c]) add_to_corners(c, far_.tangent(c), to);
  const double rate_1_s = body_->dynamics().body().mass_damping_1_s;
  for (std::uint32_t row = 0; row < body_->size() && rate_1_s > 0; ++row)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      to.at(pattern_.pattern().diagonal(row))[TetraBunch::kNumbers + 4 * axis] +=
          rate_1_s * body_->masses()[3 * static_cast<Eigen::Index>(row) + axis];
}

void RefinedSolid::add_near(bool clamp, SolidMatrices& to) const {
  for (const Near& near : near_) {
    const std::vector<Pair> sums = near.tetrahedra.sums(x_, clamp);
    for (std::size_t k = 0; k < sums.size(); ++k) {
      const auto [a, b] = near.tetrahedra.links()[k];
      const std::uint32_t p = near.rows[a], q = near.rows[b];
      if (p != RefinedBody::kNone && q != RefinedBody::kNone) {
        add(sums[k], p, q, near.places[k], to);
      } else if (p != q) {
        const bool a_is_near = p != RefinedBody::kNone;
        const Pair from_near = a_is_near ? sums[k] : TetraBunch::transposed(sums[k]);
        const FarField::Shape& n = near.shapes[a_is_near ? b : a];
        const auto entries = pattern_.of_border(near.places[k]);
        for (std::size_t c = 0; c < entries.size(); ++c)
          add(n[static_cast<Eigen::Index>(c)] * from_near, std::min(p, q), body_->corner(body_->far().corners_of(near.cell)[c]),
              entries[c], to);
      }
    }
    if (near.cell == RefinedBody::kNone) continue;
    CornerTangent<TetraBunch::kNumbers> at_corners;
    for (Pair& pair : at_corners) pair.setZero();
    add_over_corners(near.tetrahedra, sums, near.shapes, at_corners);
    add_to_corners(near.cell, at_corners, to);
  }
}

void RefinedSolid::assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const {
  if (!clamp) {
    tangents_.assemble(c_d, c_k, a);
    return;
  }
  SolidMatrices clamped(pattern_.pattern());
  clamped.set_zero();
  add_far(clamped);
  add_near(true, clamped);
  clamped.assemble(c_d, c_k, a);
}

const NodeArrays& RefinedSolid::forces(const BodyState& state) {
  Vector f = Vector::Zero(state.x.size());
  body_->dynamics().tetrahedra().add_forces(state.x, state.v, f);
  body_->dynamics().hexahedra().add_forces(state.x, state.v, f);
  body_->dynamics().relaxation().add_forces(state, f);
  for (std::uint32_t i = 0; i < body_->dynamics().nodes(); ++i) f_.set(i, at_node(f, i));
  return f_;
}

}  // namespace palpate
