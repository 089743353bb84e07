#include "server/reduce/refined_springs.hpp"

namespace palpate {

RefinedSprings::RefinedSprings(const RefinedBody& body) : RefinedElements(body), forces_(body.dynamics().body()) {}

void RefinedSprings::lay_out() {
  take_springs();
  std::vector<RefinedPattern::Pair> pairs;
  std::vector<RefinedPattern::Border> borders;
  const auto at = [&](std::uint32_t node) { return body_->coordinate(node); };
  for (const Spring& spring : springs_) {
    if (spring.end == RefinedBody::kNone)
      pairs.emplace_back(at(spring.numbers.a), at(spring.numbers.b));
    else
      borders.emplace_back(at(spring.numbers.a), ends_[spring.end].cell);
  }
  pattern_ = RefinedPattern(*body_, std::move(pairs), std::move(borders));
  tangents_ = SpringMatrices(pattern_.pattern());
  for (Spring& spring : springs_) {
    const std::uint32_t a = at(spring.numbers.a), b = at(spring.numbers.b);
    spring.a_a = pattern_.pattern().diagonal(a);
    if (spring.end == RefinedBody::kNone) {
      spring.b_b = pattern_.pattern().diagonal(b);
      spring.a_b = pattern_.entry(a, b);
    } else {
      spring.border = pattern_.border({a, ends_[spring.end].cell});
    }
  }
}

void RefinedSprings::take_springs() {
  springs_.clear();
  ends_.clear();
  const LumpedBody& body = body_->dynamics().body();
  std::vector<std::uint32_t> end_of(body.nodes.size(), RefinedBody::kNone);
  for (const std::uint32_t e : near_elements()) {
    Spring& spring = springs_.emplace_back();
    spring.numbers = body.elements[e];
    if (body_->coordinate(spring.numbers.a) == RefinedBody::kNone) std::swap(spring.numbers.a, spring.numbers.b);
    const std::uint32_t b = spring.numbers.b;
    if (body_->coordinate(b) != RefinedBody::kNone) continue;
    if (end_of[b] == RefinedBody::kNone) {
      end_of[b] = static_cast<std::uint32_t>(ends_.size());
      ends_.push_back({body_->far().cell_of(b), body_->far().shape(b)});
    }
    spring.end = end_of[b];
  }
  states_.resize(springs_.size());
}

void RefinedSprings::take(const BodyState& state) {
  far_.take(state, body_->near());
  tangents_.set_zero();
  for (std::uint32_t c = 0; c < body_->far().cells(); ++c) {
    if (body_->near()[c]) continue;
    const auto entries = pattern_.of_corners(c);
    for (std::size_t k = 0; k < entries.size(); ++k) tangents_.at(entries[k]) += far_.tangent(c)[k];
  }
  const LumpedBody& body = body_->dynamics().body();
  const ElementKernel kernel(body.law, body.stiffening);
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const Element& e = springs_[k].numbers;
    states_[k] = kernel.evaluate(e, at_node(state.x, e.b) - at_node(state.x, e.a), at_node(state.v, e.b) - at_node(state.v, e.a));
  }
  add_near([&](std::size_t k) { return FarSprings::tangents(springs_[k].numbers, states_[k]); }, tangents_);
}

template <typename Tangents>
void RefinedSprings::add_near(const Tangents& tangents, SpringMatrices& to) const {
  std::vector<SpringMatrices::Pair> at_ends(ends_.size(), SpringMatrices::Pair::Zero());
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const Spring& spring = springs_[k];
    const SpringMatrices::Pair own = tangents(k);
    to.at(spring.a_a) += own;
    if (spring.end == RefinedBody::kNone) {
      to.at(spring.b_b) += own;
      to.at(spring.a_b) -= own;
      continue;
    }
    at_ends[spring.end] += own;
    const FarField::Shape& n = ends_[spring.end].shape;
    const auto entries = pattern_.of_border(spring.border);
    for (std::size_t p = 0; p < entries.size(); ++p) to.at(entries[p]) -= n[static_cast<Eigen::Index>(p)] * own;
  }
  for (std::size_t k = 0; k < ends_.size(); ++k) {
    const FarField::Shape& n = ends_[k].shape;
    auto entry = pattern_.of_corners(ends_[k].cell).begin();
    for (Eigen::Index p = 0; p < n.size(); ++p)
      for (Eigen::Index q = p; q < n.size(); ++q) to.at(*entry++) += n[p] * n[q] * at_ends[k];
  }
}

void RefinedSprings::assemble(double c_d, double c_k, bool clamp, BlockMatrix& a) const {
  if (!clamp) {
    tangents_.assemble(c_d, c_k, a);
    return;
  }
  SpringMatrices clamped = tangents_;
  add_near([&](std::size_t k) { return FarSprings::clamping(states_[k]); }, clamped);
  clamped.assemble(c_d, c_k, a);
}

}  // namespace palpate
