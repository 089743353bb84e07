#include "server/reduce/far_springs.hpp"

namespace palpate {
namespace {

Eigen::Array<double, FarSprings::kNumbers, 1> upper(const Mat3& m) {
  Eigen::Array<double, FarSprings::kNumbers, 1> six;
  six << m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2);
  return six;
}

}  // namespace

FarSprings::Pair FarSprings::tangents(const Element& element, const ElementState& s) {
  Pair pair;
  pair << upper(ElementKernel::stiffness_symmetric(s, false)), upper(ElementKernel::damping(element, s));
  return pair;
}

FarSprings::Pair FarSprings::clamping(const ElementState& s) {
  Pair pair = Pair::Zero();
  if (s.axial < 0)
    pair.head<kNumbers>() = upper(ElementKernel::stiffness_symmetric(s, true) - ElementKernel::stiffness_symmetric(s, false));
  return pair;
}

void FarSprings::add(const Bunch& bunch, std::uint32_t cell, const BodyState& state, CornerTangent<kNumbers>& to) const {
  const ElementKernel kernel(body_->law, body_->stiffening);
  for (const std::uint32_t e : bunch) {
    const Element& spring = body_->elements[e];
    const ElementState s = kernel.evaluate(spring, at_node(state.x, spring.b) - at_node(state.x, spring.a),
                                           at_node(state.v, spring.b) - at_node(state.v, spring.a));
    const Pair both = tangents(spring, s);
    const FarField::Shape w = field_->shape_in(spring.a, cell) - field_->shape_in(spring.b, cell);
    auto pair = to.begin();
    for (Eigen::Index p = 0; p < w.size(); ++p) {
      const Pair row = w[p] * both;
      for (Eigen::Index q = p; q < w.size(); ++q) *pair++ += w[q] * row;
    }
  }
}

}  // namespace palpate
