// Helpers shared by the source files of PatchBuilder, for these only.
#pragma once

#include "server/reduce/frame_model.hpp"

namespace palpate {

// Tolerances of solves. Measured: a basis from exact solves is no better (docs/decisions/0003). A static response is the force
// itself.
inline constexpr double kBasisTolerance = 1e-2, kStaticTolerance = 1e-3;

/// Returns the frame's linearisation. A ring gets no coarse space, which is that of a body whose far nodes move.
inline Linearisation linearisation_for(Scheme scheme, FrameModel& frame, const std::vector<std::uint8_t>& held) {
  Linearisation at = frame.linearisation(held);
  if (scheme == Scheme::ring) at.coarse = nullptr;
  return at;
}

inline Mat3 symmetric(const Mat3& m) { return 0.5 * (m + m.transpose()); }

}  // namespace palpate
