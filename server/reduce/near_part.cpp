#include "server/reduce/near_part.hpp"

#include <algorithm>

namespace palpate {

void NearPart::take(const Vec3& place, const BodyState& state) {
  if (!cut_ || (place - place_).norm() > kKeptSpacings * graded_->spacing_m()) cut(place);
  state_ = cut_->local.restricted(state);
  cut_->tangents.take(state_);
}

void NearPart::cut(const Vec3& place) {
  place_ = place;
  const LumpedBody& whole = graded_->dynamics().body();
  const double most = kSpacings * graded_->spacing_m();
  std::vector<std::uint8_t> is_end(whole.nodes.size(), 0);
  std::vector<std::uint32_t> elements;
  std::array<std::uint32_t, 2> room;
  for (const std::uint32_t e : graded_->near_elements()) {
    const std::span<const std::uint32_t> joined = nodes_of(whole, e, room);
    if (std::none_of(joined.begin(), joined.end(), [&](std::uint32_t i) { return (whole.nodes[i] - place).norm() <= most; }))
      continue;
    for (const std::uint32_t i : joined) is_end[i] = 1;
    elements.push_back(e);
  }
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < is_end.size(); ++i)
    if (is_end[i]) nodes.push_back(i);
  LocalBody local(whole, std::move(nodes));
  for (const std::uint32_t e : elements) local.add(whole, e);
  cut_ = std::make_unique<Cut>(std::move(local));
}

Matrix NearPart::moved(const Matrix& y) const { return graded_->moved(y, cut_->local.nodes); }

Vector NearPart::gathered(const Vector& forces) const {
  Vector y = Vector::Zero(graded_->masses().size());
  std::array<GradedBody::Share, FarField::kCorners> room;
  for (std::uint32_t i = 0; i < cut_->local.nodes.size(); ++i)
    for (const GradedBody::Share& share : graded_->shares(cut_->local.nodes[i], room))
      at_node(y, share.coordinate) += share.weight * at_node(forces, i);
  return y;
}

}  // namespace palpate
