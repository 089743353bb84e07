// The four gestures of a hand that examines a body, one after the other as one motion: what `palpate-lab truth` plays.
//
//     press    10 mm in within 0.3 s, held, and up again
//     stroke   6 mm in, then 15 mm sideways and back along it within 1 s, up again
//     tap      three times 6 mm in and out at 3 Hz
//     release  10 mm in within 0.3 s, and then the grip opens: the tool swings back at 5 Hz, 20 % damped
// A tool that only touches begins kGapM above the surface, and goes as deep.
#pragma once

#include "common/motion/motion.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

Motion examination(const Scene& scene);

}  // namespace palpate
