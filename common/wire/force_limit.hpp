// Largest component of a force on the wire [N], and largest unit of a shape's numbers: a receiver refuses what is beyond.
#pragma once

namespace palpate {

inline constexpr double kMaxForceN = 1e4;

}  // namespace palpate
