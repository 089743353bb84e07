// The graph of a body: nodes are joined if an edge of an element runs between them. d(i) is the number of edges from node i to
// the nearest of some others, by breadth-first search: O(nodes + edges).
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

class NodeGraph {
 public:
  static constexpr int kUnreached = std::numeric_limits<int>::max();  ///< d without a path, or without one that is short enough

  explicit NodeGraph(const LumpedBody& body);

  const std::vector<std::uint32_t>& neighbours(std::uint32_t node) const { return neighbours_[node]; }
  /// Returns d of every node to the nearest of `from`, up to `most`.
  std::vector<int> distances(std::vector<std::uint32_t> from, int most = kUnreached) const;

 private:
  std::vector<std::vector<std::uint32_t>> neighbours_;
};

}  // namespace palpate
