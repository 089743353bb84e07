// Helpers shared by the player's tests on linear and nonlinear patches.
#pragma once

#include "tests/support/patches.hpp"

namespace palpate::test {

inline constexpr Micros kStamp{5'000'000};

/// A flat frictionless surface whose vertices move alike: its force is normal and its contact point may slide freely.
inline Patch floor_patch(int r) {
  Patch p = touch_patch(r, 1, kStamp);
  p.friction = 0;
  for (int i = 1; i < p.surface.vertex_count; ++i)
    p.surface.vertices[static_cast<std::size_t>(i)].rows = p.surface.vertices[0].rows;
  return p;
}

/// A floor under a resting tool that yields only along the normal, by `row` per unit of each mode [1/kg^1/2].
inline Patch pressed_floor(const Eigen::RowVectorXd& row) {
  Patch p = floor_patch(static_cast<int>(row.size()));
  p.c_static.setZero();
  p.touching = true;
  for (PortVertex& vertex : p.surface.vertices) {
    vertex.rows.setZero(3, row.size());
    vertex.rows.row(2) = row;
  }
  return p;
}

}  // namespace palpate::test
