#include "server/reduce/near_part.hpp"

namespace palpate {

void NearPart::take(const Vec3& place, const BodyState& state) {
  const bool moved_on = !cut_ || (place - place_).norm() > kKeptSpacings * graded_->spacing_m();
  if (moved_on) cut(place);
  if (moved_on || generation_ != graded_->generation()) share();
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

void NearPart::share() {
  generation_ = graded_->generation();
  shares_.clear();
  first_.assign(1, 0);
  std::array<GradedBody::Share, FarField::kCorners> room;
  for (const std::uint32_t node : cut_->local.nodes) {
    const std::span<const GradedBody::Share> of_node = graded_->shares(node, room);
    shares_.insert(shares_.end(), of_node.begin(), of_node.end());
    first_.push_back(static_cast<std::uint32_t>(shares_.size()));
  }
}

Matrix NearPart::moved(const Matrix& y) const {
  const auto at = [](std::size_t row) { return 3 * static_cast<Eigen::Index>(row); };
  Matrix moved = Matrix::Zero(at(cut_->local.nodes.size()), y.cols());
  for (Eigen::Index column = 0; column < y.cols(); ++column)
    for (std::size_t i = 0; i < cut_->local.nodes.size(); ++i)
      for (std::uint32_t k = first_[i]; k < first_[i + 1]; ++k)
        moved.col(column).segment<3>(at(i)) += shares_[k].weight * y.col(column).segment<3>(at(shares_[k].coordinate));
  return moved;
}

Vector NearPart::gathered(const Vector& forces) const {
  Vector y = Vector::Zero(graded_->masses().size());
  for (std::uint32_t i = 0; i < cut_->local.nodes.size(); ++i)
    for (std::uint32_t k = first_[i]; k < first_[i + 1]; ++k)
      at_node(y, shares_[k].coordinate) += shares_[k].weight * at_node(forces, i);
  return y;
}

}  // namespace palpate
