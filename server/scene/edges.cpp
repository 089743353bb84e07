#include <algorithm>

#include "server/scene/scene.hpp"

namespace palpate {

std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_of(const LumpedBody& body) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(body.elements.size());
  for (const Element& e : body.elements) edges.emplace_back(e.a, e.b);
  if (!body.is_solid()) return edges;
  std::vector<std::vector<std::uint32_t>> above(body.nodes.size());  // nodes of higher number that share a cell with each
  constexpr std::size_t kInLattice = 13;
  for (auto& each : above) each.reserve(kInLattice);
  const auto add = [&](const auto& cells) {
    for (const auto& cell : cells)
      for (std::size_t i = 0; i < cell.nodes.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
          const auto [low, high] = std::minmax(cell.nodes[i], cell.nodes[j]);
          if (low != high && std::ranges::find(above[low], high) == above[low].end()) above[low].push_back(high);
        }
  };
  add(body.tetrahedra);
  add(body.hexahedra);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> of_springs;
  for (const auto& [a, b] : edges) of_springs.emplace_back(std::minmax(a, b));
  std::sort(of_springs.begin(), of_springs.end());
  for (std::uint32_t low = 0; low < above.size(); ++low) {
    std::sort(above[low].begin(), above[low].end());
    for (const std::uint32_t high : above[low])
      if (!std::binary_search(of_springs.begin(), of_springs.end(), std::pair{low, high})) edges.emplace_back(low, high);
  }
  return edges;
}

double mean_edge_m(const LumpedBody& body) {
  const auto edges = edges_of(body);
  double sum = 0;
  for (const auto& [a, b] : edges) sum += (body.nodes[b] - body.nodes[a]).norm() / static_cast<double>(edges.size());
  return sum;
}

std::size_t own_nodes(const LumpedBody& body) {
  std::size_t own = 0;
  const auto count = [&](const auto& nodes) {
    for (const std::uint32_t node : nodes)
      if (body.is_node(node)) own = std::max<std::size_t>(own, node + 1);
  };
  for (const Triangle& t : body.triangles) count(t);
  for (const Tetrahedron& t : body.tetrahedra) count(t.nodes);
  for (const Hexahedron& h : body.hexahedra) count(h.nodes);
  return own > 0 ? own : body.nodes.size();
}

NodeWeights merged(NodeWeights weights) {
  std::sort(weights.begin(), weights.end());
  NodeWeights each;
  for (const auto& [node, weight] : weights) {
    if (!each.empty() && each.back().first == node)
      each.back().second += weight;
    else if (weight > 0)
      each.emplace_back(node, weight);
  }
  return each;
}

std::uint8_t LumpedBody::member_of(std::uint32_t vertex) const {
  const auto holds = [vertex](const Member& m) { return m.first_node <= vertex && vertex < m.end_node; };
  const auto at = std::ranges::find_if(members, holds);
  return at == members.end() ? std::uint8_t{0} : static_cast<std::uint8_t>(at - members.begin());
}

std::vector<Vec3> vertices_at_rest(const LumpedBody& body) {
  std::vector<Vec3> vertices = body.nodes;
  for (const EmbeddedVertex& vertex : body.embedded) {
    Vec3 sum = Vec3::Zero();
    for (const auto& [node, weight] : vertex.weights) sum += weight * body.nodes[node];
    vertices.push_back(sum);
  }
  return vertices;
}

}  // namespace palpate
