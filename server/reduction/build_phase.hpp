// Parts of the computation of a frame's patches, for measurements of their cost.
#pragma once

#include <cstddef>
#include <cstdint>

namespace palpate {

enum class BuildPhase : std::uint8_t {
  linearise,  ///< K and D of the body, and P
  solve,      ///< solves with P
  basis,      ///< orthonormal directions
  project,    ///< K and D on them, and the modes of this pair
  rollouts,   ///< states of the body along predicted hand motions, before nonlinear patches
  other       ///< positions of tools, the local surface, and the rest
};
inline constexpr std::size_t kPatchParts = static_cast<std::size_t>(BuildPhase::other) + 1;  ///< `other` is the last

}  // namespace palpate
