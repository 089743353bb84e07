#include "bench/paper/node_graph.hpp"

#include <cassert>

namespace palpate {

NodeGraph::NodeGraph(const LumpedBody& body) : neighbours_(body.nodes.size()) {
  for (const auto& [a, b] : edges_of(body)) {
    neighbours_[a].push_back(b);
    neighbours_[b].push_back(a);
  }
}

std::vector<int> NodeGraph::distances(std::vector<std::uint32_t> from, int most) const {
  assert(most >= 0);
  std::vector<int> distance(neighbours_.size(), kUnreached);
  for (const std::uint32_t i : from) distance[i] = 0;
  for (std::size_t next = 0; next < from.size(); ++next) {
    const std::uint32_t i = from[next];
    if (distance[i] == most) break;
    for (const std::uint32_t j : neighbours_[i]) {
      if (distance[j] != kUnreached) continue;
      distance[j] = distance[i] + 1;
      from.push_back(j);
    }
  }
  return distance;
}

}  // namespace palpate
