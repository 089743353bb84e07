// What the parts of PatchBuilder share; for its own files.
#pragma once

#include "server/reduce/frame_model.hpp"

namespace palpate {

// Of solves. Measured: a basis from exact ones is no truer (docs/decisions/0003). A static response is the force itself.
inline constexpr double kBasisTolerance = 1e-2, kStaticTolerance = 1e-3;

/// The coarse space is that of a body whose far nodes move: none for a ring.
inline Linearisation linearisation_for(Scheme scheme, FrameModel& frame, const std::vector<std::uint8_t>& held) {
  Linearisation at = frame.linearisation(held);
  if (scheme == Scheme::ring) at.coarse = nullptr;
  return at;
}

inline Mat3 symmetric(const Mat3& m) { return 0.5 * (m + m.transpose()); }

}  // namespace palpate
