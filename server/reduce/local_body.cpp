#include "server/reduce/local_body.hpp"

#include <algorithm>

namespace palpate {

LocalBody::LocalBody(const LumpedBody& whole, std::vector<std::uint32_t> chosen) : nodes(std::move(chosen)) {
  body.planar = whole.planar;
  body.law = whole.law;
  body.stiffening = whole.stiffening;
  for (const std::uint32_t node : nodes) {
    body.nodes.push_back(whole.nodes[node]);
    body.masses_kg.push_back(whole.masses_kg[node]);
    body.fixed.push_back(whole.fixed[node]);
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

PortRows LocalBody::rows(std::uint32_t node, const Matrix& v) const {
  const std::uint32_t i = index(node);
  return i < nodes.size() ? PortRows(v.middleRows<3>(3 * static_cast<Eigen::Index>(i))) : PortRows::Zero(3, v.cols());
}

}  // namespace palpate
