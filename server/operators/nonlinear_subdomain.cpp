#include "server/operators/nonlinear_subdomain.hpp"

#include <algorithm>
#include <cassert>

namespace palpate {

void NonlinearSubdomain::take(const Vec3& place, const BodyState& state) {
  if (!cut_ || (place - place_).norm() > kKeptSpacings * refined_->spacing_m()) cut(place);
  state_ = cut_->local.restricted(state);
  cut_->whole.take(state_);
}

void NonlinearSubdomain::cut(const Vec3& place) {
  place_ = place;
  const LumpedBody& whole = refined_->dynamics().body();
  const double most = kReachSpacings * refined_->spacing_m();
  std::vector<std::uint8_t> is_end(whole.nodes.size(), 0);
  std::vector<std::uint32_t> elements;
  std::array<std::uint32_t, 2> scratch;
  for (const std::uint32_t e : refined_->near_elements()) {
    const std::span<const std::uint32_t> joined = nodes_of(whole, e, scratch);
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

Matrix NonlinearSubdomain::moved(const Matrix& y) const { return refined_->moved(y, cut_->local.nodes); }

Vector NonlinearSubdomain::gathered(const Vector& forces) const {
  assert(cut_ && forces.size() == state_.x.size());
  Vector y = Vector::Zero(refined_->masses().size());
  std::array<RefinedBody::Share, FarField::kCorners> scratch;
  for (std::uint32_t i = 0; i < cut_->local.nodes.size(); ++i)
    for (const RefinedBody::Share& share : refined_->shares(cut_->local.nodes[i], scratch))
      at_node(y, share.coordinate) += share.weight * at_node(forces, i);
  return y;
}

}  // namespace palpate
