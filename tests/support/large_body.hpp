// A body that is large enough to be locally refined.
#pragma once

#include "server/operators/refined_body.hpp"
#include "tests/support/bodies.hpp"

namespace palpate::test {

inline constexpr int kLargeEdge = 14;  ///< nodes along each edge
/// Node in the middle of the top.
inline constexpr std::uint32_t kTop = kLargeEdge / 2 + kLargeEdge * (kLargeEdge / 2 + kLargeEdge * (kLargeEdge - 1));

enum class Filling { springs, neo_hookean, corotational, hexahedra };
inline LumpedBody large_body(Filling filling = Filling::springs) {
  if (filling == Filling::springs) return box_body(kLargeEdge, kLargeEdge, kLargeEdge);
  SolidMaterial material;
  material.law = filling == Filling::corotational ? SolidLaw::corotational : SolidLaw::neo_hookean;
  material.young_pa = 10'000;
  material.poisson = 0.4;
  material.damping_s = 0.004;
  LumpedBody body = filling == Filling::hexahedra ? hexa_box(kLargeEdge, kLargeEdge, kLargeEdge, material)
                                                  : solid_box(kLargeEdge, kLargeEdge, kLargeEdge, material);
  body.mass_damping_1_s = 0.5;
  return body;
}

/// T y of one column, node by node.
inline Vector moved_by(const RefinedBody& refined, const Vector& y) {
  Vector x(3 * static_cast<Eigen::Index>(refined.dynamics().nodes()));
  for (std::uint32_t i = 0; i < refined.dynamics().nodes(); ++i) at_node(x, i) = refined.rows(i, y);
  return x;
}

inline void focus_on(RefinedBody& refined, std::uint32_t node) {
  const Vec3 place = refined.dynamics().body().nodes[node];
  refined.focus(std::span(&place, 1), std::span(&node, 1));
}

/// A tool that holds the middle of the top.
inline std::vector<ToolPort> grasped_top() {
  std::vector<ToolPort> ports(1);
  ports[0].kind = ContactKind::attach;
  ports[0].node = kTop;
  return ports;
}

}  // namespace palpate::test
