// The two-layer local model: a small body of the nodes around the contact whose outer elements represent the rest of the body.
//
// Inner layer: the contact's nodes, their neighbours (the ring), and the elements between them, unchanged. Outer layer: each
// element that leaves the ring is kept, its far node held where it is, with k and b multiplied by the scale of a block that
// reaches from the ring to the end of the specimen, m elements away (block_scaling.hpp); elements along the surface by the square
// root of that scale:
//
//     k' = s k,  b' = s b,      s = 1 / W(m), or W(m)^-1/2 on the surface
//
// m: elements on the shortest path through the outer element to a fixed node. A ring node whose outer elements have m on average
// gets half of the masses on such a path, the other half goes to the held end:
//
//     mass' = mass (1 + (m - 1) / 2)
//
// In one dimension s = 1/m, and a straight chain of four elements becomes exactly eq. 12 of the paper: x - (k, b) - 2m - (k/3,
// b/3) - wall. If no path leads to a fixed node (a body held nowhere), outer elements are left out: s = 0.
//
// The paper gives the rules for one dimension in equations and beyond it in words; the interpretation used here, and the results
// of the others, are in docs/decisions/0009-two-layer.md. The rules suit a body of one material whose ends are held. Towards a
// free side the model is too stiff for slow motion, though less than `ring`; below a stiff skin of soft tissue it fails as `ring`
// does. Source: Cavusoglu and Tendick, sections 5, 5.1 and 5.2, figs 10, 14 and 16.
#pragma once

#include "bench/paper/node_graph.hpp"
#include "bench/paper/second_order.hpp"
#include "server/operators/local_body.hpp"

namespace palpate {

class TwoLayer {
 public:
  static constexpr int kLayers = 1;  ///< layers of neighbours that are kept: the ring of the paper

  /// `body` must outlive it.
  explicit TwoLayer(const LumpedBody& body);

  /// Returns the local body around `contact`. `held` nodes stay still, in addition to the fixed ones.
  LocalBody around(const std::vector<std::uint32_t>& contact, const std::vector<std::uint8_t>& held) const;

 private:
  const LumpedBody* body_;
  int dimension_ = 3;
  NodeGraph graph_;
  std::vector<std::uint8_t> surface_;  // 1 for nodes with fewer neighbours than inner ones
  std::vector<int> to_end_;            // elements to the nearest fixed node
};

/// Returns the unreduced model around one held node. Coordinates are those of the whole body.
SecondOrderSystem two_layer_system(const Dynamics& dynamics, const BodyState& state, std::uint32_t port_node);

}  // namespace palpate
