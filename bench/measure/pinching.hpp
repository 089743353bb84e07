// The motion of a hand that grasps a fold with jaws (tool_shape.hpp) and pulls at it, as `palpate-lab tools --pinch` plays it.
// The tool's z axis is along the outward normal at the beginning, above the edge of the fold, with a jaw on either side:
//
//     astride  22 mm in within 0.4 s, with the jaws open by kAstrideOpening
//     closes   to a given opening within 0.4 s; held for 0.2 s
//     pulls    10 mm out along the normal within 1.5 s; held for 0.3 s
//     opens    within 0.2 s, and leaves upwards
#pragma once

#include "bench/measure/examination.hpp"

namespace palpate {

inline constexpr double kAstrideOpening = 0.4;
/// First and last moment of the pull [s].
inline constexpr double kPullBeginsS = 1.0, kPullEndsS = 2.8;

Motion pinching(const ExaminedPlace& place, double closed);

}  // namespace palpate
