// A body cut out of another.
#pragma once

#include <cstdint>
#include <vector>

#include "common/port/patch.hpp"
#include "server/body/dynamics.hpp"

namespace palpate {

struct LocalBody {
  LumpedBody body;                   ///< no triangles
  std::vector<std::uint32_t> nodes;  ///< of the whole body, ascending, for each of its nodes

  LocalBody() = default;
  /// These nodes, fixed where they are, without elements.
  LocalBody(const LumpedBody& whole, std::vector<std::uint32_t> nodes);
  /// Index here of a node of the whole body; nodes.size() when it is not here.
  std::uint32_t index(std::uint32_t node) const;
  /// Rows of a basis of the local body for a node of the whole one, zero when it is not here.
  PortRows rows(std::uint32_t node, const Matrix& v) const;
  /// The rows of a vector of the whole body (3 N).
  Vector restricted(const Vector& whole) const;
  BodyState restricted(const BodyState& whole) const { return {whole.time_s, restricted(whole.x), restricted(whole.v)}; }
};

}  // namespace palpate
