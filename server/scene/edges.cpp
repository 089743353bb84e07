#include <algorithm>
#include <set>

#include "server/scene/scene.hpp"

namespace palpate {

std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_of(const LumpedBody& body) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(body.elements.size());
  for (const Element& e : body.elements) edges.emplace_back(e.a, e.b);
  if (!body.is_solid()) return edges;
  std::set<std::pair<std::uint32_t, std::uint32_t>> of_springs, of_cells;
  for (const auto& [a, b] : edges) of_springs.insert(std::minmax(a, b));
  const auto add = [&](const auto& cells) {
    for (const auto& cell : cells)
      for (std::size_t i = 0; i < cell.nodes.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
          if (cell.nodes[i] != cell.nodes[j]) of_cells.insert(std::minmax(cell.nodes[i], cell.nodes[j]));
  };
  add(body.tetrahedra);
  add(body.hexahedra);
  std::set_difference(of_cells.begin(), of_cells.end(), of_springs.begin(), of_springs.end(), std::back_inserter(edges));
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
