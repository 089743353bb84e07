// Whether a motion that nobody holds dies out.
//
// The motion after the release is cut into windows of 0.3 s. In each: p, the peak-to-peak motion (the diagonal of the box that
// the tool stays in), and T, the highest kinetic energy. With `head` the first two windows and `tail` the last two,
//
//     stable:  p_tail <= max(p_head / 4, kStillM)   and   T_tail <= max(T_head / 16, kStillJ)   and the tool was not lost
//
// (in a pure oscillation the two say the same: energy goes with the square of motion). A limit cycle is not stable, nor is an
// oscillation that takes more than the observed time to fall to a quarter. The rate at which the motion dies out is the
// least-squares slope of ln p over time, windows below kStillM left out.
#pragma once

#include <span>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

inline constexpr double kWindowS = 0.3;
inline constexpr double kStillM = 1e-4;  ///< three steps of the device's position reading
inline constexpr double kStillJ = 1e-7;  ///< of 75 g in an oscillation of kStillM, peak to peak, at 5 Hz

struct StabilityVerdict {
  bool stable = false;
  std::vector<double> peak_to_peak_m;  ///< of the successive whole windows; at least one, cut short when the tool was lost
  std::vector<double> kinetic_max_j;
  double growth_1_s = 0;  ///< of the motion, negative: dies out; 0 when fewer than two windows move
};

/// One entry a millisecond, from the release on. `lost`: the motion ended because the tool went too far.
StabilityVerdict judge_motion(std::span<const Vec3> position, std::span<const double> kinetic_j, bool lost);

}  // namespace palpate
