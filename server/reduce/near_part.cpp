#include "server/reduce/near_part.hpp"

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
  std::vector<Element> elements;
  for (const std::uint32_t e : graded_->near_elements()) {
    const Element& element = whole.elements[e];
    if ((whole.nodes[element.a] - place).norm() > most && (whole.nodes[element.b] - place).norm() > most) continue;
    is_end[element.a] = is_end[element.b] = 1;
    elements.push_back(element);
  }
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < is_end.size(); ++i)
    if (is_end[i]) nodes.push_back(i);
  LocalBody local(whole, std::move(nodes));
  for (Element& element : elements) {
    element.a = local.index(element.a);
    element.b = local.index(element.b);
  }
  local.body.elements = std::move(elements);
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
