#include "server/operators/local_body.hpp"

#include <algorithm>
#include <cassert>

namespace palpate {

std::uint32_t elements_of(const LumpedBody& body) {
  return static_cast<std::uint32_t>(body.is_solid() ? body.tetrahedra.size() + body.hexahedra.size() : body.elements.size());
}

std::span<const std::uint32_t> nodes_of(const LumpedBody& body, std::uint32_t element, std::array<std::uint32_t, 2>& scratch) {
  if (element < body.hexahedra.size()) return body.hexahedra[element].nodes;
  if (!body.tetrahedra.empty()) return body.tetrahedra[element - body.hexahedra.size()].nodes;
  scratch = {body.elements[element].a, body.elements[element].b};
  return scratch;
}

LocalBody::LocalBody(const LumpedBody& whole, std::vector<std::uint32_t> chosen) : nodes(std::move(chosen)) {
  assert(std::is_sorted(nodes.begin(), nodes.end()) && (nodes.empty() || nodes.back() < whole.nodes.size()));
  body.planar = whole.planar;
  body.law = whole.law;
  body.stiffening = whole.stiffening;
  body.materials = whole.materials;
  body.mass_damping_1_s = whole.mass_damping_1_s;
  for (const std::uint32_t node : nodes) {
    body.nodes.push_back(whole.nodes[node]);
    body.masses_kg.push_back(whole.masses_kg[node]);
    body.fixed.push_back(whole.fixed[node]);
  }
}

void LocalBody::add(const LumpedBody& whole, std::uint32_t element) {
  const auto take = [&](const auto& from, auto& to) {
    for (std::uint32_t& node : to.emplace_back(from).nodes) node = index(node);
  };
  if (!whole.is_solid()) {
    Element& e = body.elements.emplace_back(whole.elements[element]);
    e.a = index(e.a);
    e.b = index(e.b);
    assert(e.a < nodes.size() && e.b < nodes.size());
  } else if (element < whole.hexahedra.size()) {
    take(whole.hexahedra[element], body.hexahedra);
  } else {
    take(whole.tetrahedra[element - whole.hexahedra.size()], body.tetrahedra);
  }
}

std::uint32_t LocalBody::index(std::uint32_t node) const {
  const auto at = std::lower_bound(nodes.begin(), nodes.end(), node);
  return static_cast<std::uint32_t>(at != nodes.end() && *at == node ? at - nodes.begin() : nodes.end() - nodes.begin());
}

Vector LocalBody::restricted(const Vector& whole) const {
  Vector y(3 * static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t i = 0; i < nodes.size(); ++i)
    y.segment<3>(3 * static_cast<Eigen::Index>(i)) = whole.segment<3>(3 * static_cast<Eigen::Index>(nodes[i]));
  return y;
}

NodeWeights LocalBody::restricted(const NodeWeights& whole) const {
  NodeWeights here;
  for (const auto& [node, weight] : whole)
    if (const std::uint32_t i = index(node); i < nodes.size()) here.emplace_back(i, weight);
  return here;
}

PortRows LocalBody::rows(std::uint32_t node, const Matrix& v) const {
  const std::uint32_t i = index(node);
  return i < nodes.size() ? PortRows(v.middleRows<3>(3 * static_cast<Eigen::Index>(i))) : PortRows::Zero(3, v.cols());
}

}  // namespace palpate
