// A model observer that presses a finger onto tissue, over a lump and beside it, and compares how stiff the two places feel.
//
// Body: a block of 80 x 80 x 40 mm of kLumpYoungPa, held below, in hexahedra of 8 mm, with a ball of another stiffness under its
// middle, covered by kCoverM of tissue (server/scene/lump.hpp). Beside the lump is the block without it.
// Hand: presses to a mean depth of 5 mm within 0.5 s, then moves by +-2.5 mm at 1 Hz for three periods; its tremor (8-12 Hz,
// 0.1 mm; client/device/hand.hpp) is added. The path does not depend on the force: the stability of the loop is another
// experiment. Percept: with depth x [m] and felt force f [N] of every millisecond of the three periods,
//
//     K = cov(f, x) / var(x)                                        stiffness that is felt [N/m]
//     s = sqrt((1 - r^2) var(f) / (var(x) (kLooks - 2)))            its spread: all force that does not follow the depth
//
// r the correlation of f and x, kLooks = 6 the number of independent looks, two a period. Without a network r is nearly 1. A
// force that comes late loses the part in phase with the depth, and what is out of phase is noise to an observer that does not
// know the delay. Decision: the lump is detected where
//
//     index = |K_lump - K_beside| / sqrt((w K_beside)^2 + s_lump^2 + s_beside^2) >= 1      (d' = 1)
//
// w the Weber fraction of stiffness.
//
// Assumptions: one press at each place, known places, no cue but stiffness (none from skin, sound or sight); w does not change
// with stiffness. Sources of w: 0.08 with cues of force and work (Tan, Pang, Durlach, 1992), 0.22 without (Tan, Durlach,
// Beauregard, Srinivasan, Perception & Psychophysics 57, 495-510, 1995), both for compliance between thumb and finger. kLooks is
// a choice.
#pragma once

#include <span>
#include <vector>

#include "bench/fidelity/replay.hpp"

namespace palpate {

inline constexpr double kLumpYoungPa = 5000, kCoverM = 0.005, kLooks = 6, kWeber = 0.15;
inline constexpr double kLargestLumpM = 0.03;  ///< a larger one would reach the held face

/// The block; a diameter of 0 is the place beside the lump.
Scene lump_scene(double diameter_m, double stiffness_ratio);

/// The hand's path over the middle of the block.
Motion lump_press(const Scene& scene);

struct FeltStiffness {
  double stiffness_n_m = 0, spread_n_m = 0;
};
/// `position` and `force` of every millisecond from the start of lump_press() on.
FeltStiffness felt_stiffness(std::span<const Vec3> position, std::span<const Vec3> force);

double detection_index(const FeltStiffness& lump, const FeltStiffness& beside, double weber);

struct IndexAt {
  double diameter_m = 0, index = 0;
};
/// Diameter above which every index is at least 1, linear between those given, ascending and above 0. Where they all are it is
/// the smallest that is given: an upper bound. Negative where there is none.
double detectable_diameter_m(std::span<const IndexAt> indices);

}  // namespace palpate
