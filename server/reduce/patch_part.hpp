// What making the patches of a frame is made of, for those who ask what it costs.
#pragma once

#include <cstddef>
#include <cstdint>

namespace palpate {

enum class PatchPart : std::uint8_t {
  linearise,  ///< K and D of the body, and P
  solve,      ///< with P
  basis,      ///< orthonormal directions
  project,    ///< K and D on them, and the modes of the pair
  rollouts,   ///< where the body is when hands move on, before nonlinear patches
  other       ///< where tools stand, the local surface, what is left
};
inline constexpr std::size_t kPatchParts = static_cast<std::size_t>(PatchPart::other) + 1;  ///< `other` is the last

}  // namespace palpate
