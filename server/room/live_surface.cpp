#include "server/room/live_surface.hpp"

#include <numeric>

namespace palpate {

LiveSurface::LiveSurface(const LumpedBody& begun) : begun_nodes_(static_cast<std::uint32_t>(begun.nodes.size())) {
  const std::vector<Vec3> rest = vertices_at_rest(begun);
  for (std::uint32_t i = 0; i < rest.size(); ++i) {
    all_.vertices.push_back({rest[i], begun.is_fixed(i), begun.is_wall(i)});
    vertex_numbers_.push_back(i);
    if (i >= begun_nodes_) embedded_.try_emplace(begun.embedded[i - begun_nodes_].weights, i);
  }
  node_numbers_.assign(vertex_numbers_.begin(), vertex_numbers_.begin() + begun_nodes_);
}

std::uint32_t LiveSurface::number_of(const LumpedBody& body, const EmbeddedVertex& vertex) {
  NodeWeights weights = vertex.weights;
  Vec3 rest = Vec3::Zero();
  for (auto& [node, weight] : weights) {
    rest += weight * body.nodes[node];
    node = node_numbers_[node];
  }
  const auto [at, fresh] = embedded_.try_emplace(merged(std::move(weights)), static_cast<std::uint32_t>(all_.vertices.size()));
  if (fresh) all_.vertices.push_back({rest, false, vertex.is_wall});
  return at->second;
}

void LiveSurface::renew(const LumpedBody& body, const CutChange* change) {
  if (!change) {
    node_numbers_.resize(begun_nodes_);
    std::iota(node_numbers_.begin(), node_numbers_.end(), 0U);
  } else {
    std::vector<std::uint8_t> taken(node_numbers_.size(), 0);
    std::vector<std::uint32_t> numbers;
    for (std::uint32_t k = 0; k < body.nodes.size(); ++k) {
      const std::uint32_t before = change->node_before[k];
      if (taken[before] != 0) {
        numbers.push_back(static_cast<std::uint32_t>(all_.vertices.size()));
        all_.vertices.push_back({body.nodes[k], body.is_fixed(k), false});
      } else {
        numbers.push_back(node_numbers_[before]);
      }
      taken[before] = 1;
    }
    node_numbers_ = std::move(numbers);
  }
  vertex_numbers_ = node_numbers_;
  for (const EmbeddedVertex& vertex : body.embedded) vertex_numbers_.push_back(number_of(body, vertex));
  all_.triangles.clear();
  for (const Triangle& t : body.triangles)
    all_.triangles.push_back({vertex_numbers_[t[0]], vertex_numbers_[t[1]], vertex_numbers_[t[2]]});
  now_ = std::make_shared<const BodySurface>(all_);
}

}  // namespace palpate
