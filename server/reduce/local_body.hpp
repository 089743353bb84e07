// A body cut out of another.
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
  /// These nodes, fixed where they are, without elements.
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
