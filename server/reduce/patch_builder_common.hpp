// What the parts of PatchBuilder share; for its own files.
#pragma once

#include <cmath>

#include "server/reduce/frame_model.hpp"

namespace palpate {

inline constexpr double kBasisTolerance = 1e-2, kStaticTolerance = 1e-3;  // of solves

/// The coarse space is that of a body whose far nodes move: none for a ring.
inline Linearisation linearisation_for(Scheme scheme, FrameModel& frame, const std::vector<std::uint8_t>& held) {
  Linearisation at = frame.linearisation(held);
  if (scheme == Scheme::ring) at.coarse = nullptr;
  return at;
}

inline Mat3 symmetric(const Mat3& m) { return 0.5 * (m + m.transpose()); }

/// How far the tool is likely to move along each axis while a patch lasts [m].
inline Vec3 expected_motion(const ToolAt& tool, double bridge_s) {
  constexpr double kLeastM = 0.002;
  Vec3 far;
  for (int axis = 0; axis < 3; ++axis) far[axis] = std::hypot(tool.velocity[axis] * bridge_s, kLeastM);
  return far;
}

}  // namespace palpate
