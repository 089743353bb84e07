// What the parts of PatchBuilder share; for its own files.
#pragma once

#include <cmath>

#include "server/reduce/frame_model.hpp"

namespace palpate {

inline constexpr double kBasisTolerance = 1e-2, kStaticTolerance = 1e-3;  // of solves

inline Mat3 symmetric(const Mat3& m) { return 0.5 * (m + m.transpose()); }

/// How far the tool is likely to move along each axis while a patch lasts [m].
inline Vec3 expected_motion(const ToolAt& tool, double bridge_s) {
  constexpr double kLeastM = 0.002;
  Vec3 far;
  for (int axis = 0; axis < 3; ++axis) far[axis] = std::hypot(tool.velocity[axis] * bridge_s, kLeastM);
  return far;
}

}  // namespace palpate
