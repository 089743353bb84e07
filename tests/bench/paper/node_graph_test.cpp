#include "bench/paper/node_graph.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

// All nodes of a cell are joined to each other, so the number of edges from a corner equals the largest number of cells along any
// axis.
TEST_CASE("In a block nodes are as many edges from a corner as the longest of their three coordinates says") {
  const LumpedBody body = box_body(5, 4, 3);
  const NodeGraph graph(body);
  const std::vector<int> all = graph.distances({0}), some = graph.distances({0}, 2);
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    const int cells = static_cast<int>(std::lround((body.nodes[i] - body.nodes[0]).lpNorm<Eigen::Infinity>() / kSpacingM));
    CAPTURE(i, cells);
    CHECK(all[i] == cells);
    CHECK(some[i] == (cells <= 2 ? cells : NodeGraph::kUnreached));
  }
}

TEST_CASE("No way leads to a node without elements, and from several nodes the nearest counts") {
  LumpedBody body = box_body(6, 1, 1);
  body.nodes.push_back(Vec3(1, 1, 1));
  const std::vector<int> d = NodeGraph(body).distances({0, 5});
  CHECK(std::equal(d.begin(), d.end(), std::vector<int>{0, 1, 2, 2, 1, 0, NodeGraph::kUnreached}.begin()));
}
