// A body cut out of another: some of its nodes and, added one by one, elements between them.
//
//     x_i = X_nodes[i],     restricted(y) = S y,   S the rows of these nodes;     rows of a node that is here V_i, else 0
//
// Shapes: N nodes of the whole body, n here, ascending; x 3 n, X and y 3 N (positions [m], velocities [m/s], forces [N]); S 3 n
// x 3 N; V 3 n x r, V_i 3 x r; masses [kg].
//
// It has the masses, materials and law of the whole body, and neither its gravity, its triangles nor its Prony series. Of a
// solid elements are finite elements; its springs (ligaments) are none.
// What can go wrong: an element that is not added is missing, so nodes that it joins are out of balance where those of the
// whole body are not; a caller fixes them or takes differences. Weights of nodes that are not here are left out of a sum that
// was 1.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/port/patch.hpp"
#include "server/body/dynamics.hpp"
#include "server/body/skin.hpp"

namespace palpate {

/// How many elements a body has, and the nodes that one of them joins: of its springs, or of a solid's finite elements, hexahedra
/// before tetrahedra and triangles.
std::uint32_t elements_of(const LumpedBody& body);
std::span<const std::uint32_t> nodes_of(const LumpedBody& body, std::uint32_t element, std::array<std::uint32_t, 2>& scratch);

struct LocalBody {
  LumpedBody body;                   ///< no triangles
  std::vector<std::uint32_t> nodes;  ///< of the whole body, ascending, for each of its nodes

  LocalBody() = default;
  /// These nodes, fixed where the whole body's are, without elements.
  LocalBody(const LumpedBody& whole, std::vector<std::uint32_t> nodes);
  /// An element of the whole body, all of whose nodes are here.
  void add(const LumpedBody& whole, std::uint32_t element);
  /// Index here of a node of the whole body; nodes.size() when it is not here.
  std::uint32_t index(std::uint32_t node) const;
  /// Rows of a basis of the local body for a node of the whole one, zero when it is not here.
  PortRows rows(std::uint32_t node, const Matrix& v) const;
  /// The rows of a vector of the whole body (3 N).
  Vector restricted(const Vector& whole) const;
  /// Those of nodes that are here.
  Skin::Weights restricted(const Skin::Weights& whole) const;
  BodyState restricted(const BodyState& whole) const { return {whole.time_s, restricted(whole.x), restricted(whole.v)}; }
};

}  // namespace palpate
