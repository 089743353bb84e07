// A body cut out of another: a subset of its nodes and, added one by one, elements between them.
//
//     x_i = X_nodes[i],     restricted(y) = S y,   S the rows of these nodes;     rows of a node: V_i if it is here, else 0
//
// Shapes: N nodes of the whole body, n here, ascending; x 3 n, X and y 3 N (positions [m], velocities [m/s], forces [N]); S 3 n
// x 3 N; V 3 n x r, V_i 3 x r; masses [kg].
//
// It has the masses, materials and law of the whole body, but not its gravity, its triangles or its Prony series. For a solid,
// elements are finite elements; its springs (ligaments) do not count.
// Limits: elements that are not added are missing, so nodes that they join are out of balance even if those of the whole body are
// not; a caller fixes these nodes or uses differences. Weights of nodes that are not here are dropped from a sum that was 1.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/patch/patch.hpp"
#include "server/body/dynamics.hpp"
#include "server/body/skin.hpp"

namespace palpate {

/// elements_of(): number of elements of a body. nodes_of(): nodes of one element. They count its springs, or a solid's finite
/// elements, hexahedra before tetrahedra and triangles.
std::uint32_t elements_of(const LumpedBody& body);
std::span<const std::uint32_t> nodes_of(const LumpedBody& body, std::uint32_t element, std::array<std::uint32_t, 2>& scratch);

struct LocalBody {
  LumpedBody body;                   ///< no triangles
  std::vector<std::uint32_t> nodes;  ///< node of the whole body for each of its nodes, ascending

  LocalBody() = default;
  /// The body of these nodes, fixed as in the whole body, without elements.
  LocalBody(const LumpedBody& whole, std::vector<std::uint32_t> nodes);
  /// Adds an element of the whole body, all of whose nodes are here.
  void add(const LumpedBody& whole, std::uint32_t element);
  /// Returns the index here of a node of the whole body; nodes.size() if it is not here.
  std::uint32_t index(std::uint32_t node) const;
  /// Returns the rows of a basis of the local body for a node of the whole one; zero if it is not here.
  PortRows rows(std::uint32_t node, const Matrix& v) const;
  /// Returns the rows of a vector of the whole body (3 N).
  Vector restricted(const Vector& whole) const;
  /// Returns the weights of nodes that are here.
  NodeWeights restricted(const NodeWeights& whole) const;
  BodyState restricted(const BodyState& whole) const { return {whole.time_s, restricted(whole.x), restricted(whole.v)}; }
};

}  // namespace palpate
