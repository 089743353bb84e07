// Positions and velocities of the nodes of a body.
#pragma once

#include <memory>

#include "server/solve/block_matrix.hpp"

namespace palpate {

struct StressHistory;

/// x, v: 3 N (node 0 x, y, z, node 1 x, ...) [m], [m/s].
struct BodyState {
  double time_s = 0;
  Vector x, v;
  std::shared_ptr<const StressHistory> history =
      nullptr;  ///< of a solid whose stress relaxes (relaxation.hpp); null: nothing has relaxed yet
};

inline auto at_node(const Vector& y, std::uint32_t node) { return y.segment<3>(3 * static_cast<Eigen::Index>(node)); }
inline auto at_node(Vector& y, std::uint32_t node) { return y.segment<3>(3 * static_cast<Eigen::Index>(node)); }

}  // namespace palpate
