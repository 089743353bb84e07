// The two-layer local model: a small body of the nodes around the contact whose outer elements stand for the rest of the body.
//
// Inner layer: the contact's nodes, their neighbours (the ring), and the elements between them, as they are. Outer layer: each
// element that leaves the ring is kept, its far node held where it is, with k and b multiplied by the scale of a block that
// reaches from the ring to the end of the specimen, m elements away (block_scaling.hpp); elements along the surface by its square
// root:
//
//     k' = s k,  b' = s b,      s = 1 / W(m), or W(m)^-1/2 on the surface
//
// m: elements on the shortest way over the outer element to a fixed node. A ring node whose outer elements have m on average gets
// half of the masses that lie on such a way, the other half goes to the held end:
//
//     mass' = mass (1 + (m - 1) / 2)
//
// In one dimension s = 1/m, and a straight chain of four elements becomes exactly eq. 12 of the paper: x - (k, b) - 2m -
// (k/3, b/3) - wall. Where no way leads to a fixed node (a body held nowhere) outer elements are left out: s = 0.
//
// The paper gives the rules in one dimension and beyond it in words; what they were taken to mean, and what the other readings
// give, is in docs/decisions/0009-two-layer.md. They suit a body of one material whose ends are held. Towards a free side the
// model is too stiff for slow motion, though less than `ring`; below a stiff skin of soft tissue it fails as `ring` does. Source:
// Cavusoglu and Tendick, sections 5, 5.1 and 5.2, figs 10, 14 and 16.
#pragma once

#include "server/linear/second_order.hpp"
#include "server/reduce/local_body.hpp"
#include "server/reduce/node_graph.hpp"

namespace palpate {

class TwoLayer {
 public:
  static constexpr int kLayers = 1;  ///< of neighbours that are kept: the ring of the paper

  /// `body` must outlive it.
  explicit TwoLayer(const LumpedBody& body);

  /// The local body around `contact`. `held` nodes stay still, besides the fixed ones.
  LocalBody around(const std::vector<std::uint32_t>& contact, const std::vector<std::uint8_t>& held) const;

 private:
  const LumpedBody* body_;
  int dimension_ = 3;
  NodeGraph graph_;
  std::vector<std::uint8_t> surface_;  // nodes with fewer neighbours than those inside
  std::vector<int> to_end_;            // elements to the nearest fixed node
};

/// The model around one node that is held, unreduced. Coordinates are those of the whole body.
SecondOrderSystem two_layer_system(const Dynamics& dynamics, const BodyState& state, std::uint32_t port_node);

}  // namespace palpate
