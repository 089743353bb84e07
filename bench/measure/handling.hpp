// The motion of a hand that handles an instrument on a body, for tools with a body (tool_shape.hpp), as `palpate-lab tools` plays
// it: four parts, each of which begins and ends above the surface.
//
//     press    8 mm in within 0.3 s, held, and up again
//     rock     6 mm in; three times +-12 deg about the axis aside, and about the one across, at 1 and 0.7 Hz; up again
//     stroke   5 mm in, 15 mm aside and back within 1.2 s, inclined by 8 deg; up again
//     twist    6 mm in, +-25 deg about the normal at 0.8 Hz; up again
// The tool's z axis is along the outward normal at the beginning; places are those of examination.hpp.
#pragma once

#include "bench/measure/examination.hpp"

namespace palpate {

Motion handling(const ExaminedPlace& place);

}  // namespace palpate
