#include "server/reduction/refined_elements.hpp"

#include <algorithm>
#include <cassert>
#include <map>

namespace palpate {

template <class Bunch>
void RefinedElements<Bunch>::lay_out() {
  take_near();
  std::vector<RefinedPattern::Pair> pairs;
  std::vector<RefinedPattern::Border> borders;
  for (const Near& near : near_)
    for (const auto& [a, b] : near.bunch.links()) {
      const std::uint32_t p = near.rows[a], q = near.rows[b];
      if (p != RefinedBody::kNone && q != RefinedBody::kNone && p != q) pairs.emplace_back(p, q);
      if ((p == RefinedBody::kNone) != (q == RefinedBody::kNone)) borders.emplace_back(std::min(p, q), near.cell);
    }
  pattern_ = RefinedPattern(*body_, std::move(pairs), std::move(borders));
  tangents_ = Matrices(pattern_.pattern());
  for (Near& near : near_) find_places(near);
}

/// Returns the far cell that contains most of these nodes; none if none is far.
template <class Bunch>
std::uint32_t RefinedElements<Bunch>::far_home(std::span<const std::uint32_t> nodes) const {
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

template <class Bunch>
void RefinedElements<Bunch>::take_near() {
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_home;
  std::array<std::uint32_t, 2> scratch;
  for (const std::uint32_t e : near_elements()) by_home[far_home(nodes_of(body_->dynamics().body(), e, scratch))].push_back(e);
  near_.clear();
  for (const auto& [home, elements] : by_home) {
    Near& near = near_.emplace_back();
    near.bunch = Bunch(body_->dynamics(), elements);
    near.cell = home;
    for (const std::uint32_t i : near.bunch.nodes()) {
      near.rows.push_back(body_->coordinate(i));
      const bool is_far = near.rows.back() == RefinedBody::kNone;
      near.shapes.push_back(is_far ? body_->far().shape_in(i, home) : FarField::Shape(FarField::Shape::Zero()));
    }
  }
}

template <class Bunch>
void RefinedElements<Bunch>::find_places(Near& near) const {
  for (const auto& [a, b] : near.bunch.links()) {
    const std::uint32_t p = near.rows[a], q = near.rows[b];
    if (p != RefinedBody::kNone && q != RefinedBody::kNone)
      near.places.push_back(pattern_.entry(p, q));
    else if (p != q)
      near.places.push_back(pattern_.border({std::min(p, q), near.cell}));
    else
      near.places.push_back(RefinedBody::kNone);
  }
}

template <class Bunch>
void RefinedElements<Bunch>::take(const BodyState& state) {
  state_ = &state;
  far_.take(state, body_->near());
  tangents_.set_zero();
  add_far(tangents_);
  add_near(false, tangents_);
}

template <class Bunch>
void RefinedElements<Bunch>::add(const Pair& pair, std::uint32_t p, std::uint32_t q, std::uint32_t entry, Matrices& to) {
  if (p <= q)
    to.at(entry) += pair;
  else
    to.at(entry) += Bunch::transposed(pair);
}

template <class Bunch>
void RefinedElements<Bunch>::add_to_corners(std::uint32_t cell, const CornerTangent<Bunch::kNumbers>& tangent,
                                            Matrices& to) const {
  const auto& corners = body_->far().corners_of(cell);
  const auto entries = pattern_.of_corners(cell);
  std::size_t k = 0;
  for (std::size_t p = 0; p < corners.size(); ++p)
    for (std::size_t q = p; q < corners.size(); ++q, ++k)
      add(tangent[k], body_->corner(corners[p]), body_->corner(corners[q]), entries[k], to);
}

template <class Bunch>
void RefinedElements<Bunch>::add_far(Matrices& to) const {
  for (std::uint32_t c = 0; c < body_->far().cells(); ++c)
    if (!body_->near()[c]) add_to_corners(c, far_.tangent(c), to);
  const double rate_1_s = body_->dynamics().body().mass_damping_1_s;
  assert(rate_1_s == 0 || Bunch::kNumbers == 9);
  for (std::uint32_t row = 0; row < body_->size() && rate_1_s > 0; ++row)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      to.at(pattern_.pattern().diagonal(row))[Bunch::kNumbers + 4 * axis] +=
          rate_1_s * body_->masses()[3 * static_cast<Eigen::Index>(row) + axis];
}

template <class Bunch>
void RefinedElements<Bunch>::add_near(bool clamp, Matrices& to) const {
  for (const Near& near : near_) {
    const std::vector<Pair> sums = near.bunch.sums(*state_, clamp);
    for (std::size_t k = 0; k < sums.size(); ++k) {
      const auto [a, b] = near.bunch.links()[k];
      const std::uint32_t p = near.rows[a], q = near.rows[b];
      if (p != RefinedBody::kNone && q != RefinedBody::kNone) {
        add(sums[k], p, q, near.places[k], to);
      } else if (p != q) {
        const bool a_is_near = p != RefinedBody::kNone;
        const Pair from_near = a_is_near ? sums[k] : Bunch::transposed(sums[k]);
        const FarField::Shape& n = near.shapes[a_is_near ? b : a];
        const auto entries = pattern_.of_border(near.places[k]);
        for (std::size_t c = 0; c < entries.size(); ++c)
          add(n[static_cast<Eigen::Index>(c)] * from_near, std::min(p, q), body_->corner(body_->far().corners_of(near.cell)[c]),
              entries[c], to);
      }
    }
    if (near.cell == RefinedBody::kNone) continue;
    CornerTangent<Bunch::kNumbers> at_corners;
    for (Pair& pair : at_corners) pair.setZero();
    add_over_corners<Bunch>(near.bunch, sums, near.shapes, at_corners);
    add_to_corners(near.cell, at_corners, to);
  }
}

template <class Bunch>
void RefinedElements<Bunch>::assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const {
  if (!clamp) {
    tangents_.assemble(c_d, c_k, a);
    return;
  }
  Matrices clamped(pattern_.pattern());
  clamped.set_zero();
  add_far(clamped);
  add_near(true, clamped);
  clamped.assemble(c_d, c_k, a);
}

template class RefinedElements<SpringSubset>;
template class RefinedElements<SolidBunch>;

}  // namespace palpate
