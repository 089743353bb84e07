// The guided hand in the closed loop: one simulated hand guides the tool of another (client/core/guidance.hpp), each over a link
// of its own, in virtual time.
//
// The guide is the reference hand of hand.hpp. It waits 2.5 s for the hold to begin, moves kGuidedStrokeM to and fro along x in
// four minimum-jerk strokes of 0.8 s, and stands still. On the body both hands press 5 mm deep first, and the guide strokes
// there. The guided hand intends no more:
//     free      nobody holds the device: 75 g, no friction
//     led       an arm that lets itself be led: mass and damping of the reference hand, no stiffness
//     resting   an arm that stays where it is: the reference hand
// Its tool begins kGuidedBesideM beside that of the guide. There is no tremor, and forces are not quantised.
//
// Both are judged at rest as in stability.hpp, with two numbers of the coupling. Its spring K draws a tool against the dampers b
// of the coupling, b_h of several hands on a body (at most HandsDamper::kMostGuidedNSM) and b_a of the arm, so that the slowest
// motion dies out over (b + b_h + b_a) / K, 1.5 s at two round trips of 300 ms: it is observed for three times that, and at
// least 2.1 s. A step q of the encoder is a velocity to these dampers: the impulse (b + b_h) q, which no reading of a tool at
// rest can avoid, gives device and arm of mass m the speed (b + b_h) q / m, whose kinetic energy a tool at rest may have.
#pragma once

#include "bench/measure/stability.hpp"

namespace palpate {

struct GuidedPoint {
  bool touches = false;
  std::string hand = "led";
  double guide_rtt_ms = 0, guided_rtt_ms = 0, jitter_ms = 0, loss_pct = 0;
  std::uint64_t seed = 1;
};

struct GuidedResult {
  StabilityVerdict guide, guided;  ///< from a second and two round trips after the last stroke on
  bool lost = false;
  double stiffness_n_m = 0, damping_n_s_m = 0;  ///< K and b at the end
  double error_rms_m = 0;                       ///< distance of the two tools while the guide moves
  double lag_s = 0, lagged_rms_m = 0;           ///< shift of the guide's path for which that distance is least, and the distance
  double guide_mean_n = 0, guide_max_n = 0, guided_mean_n = 0, guided_max_n = 0;  ///< forces of guidance while the guide moves
  double step_max_n = 0;                                                          ///< largest change of such a force in a tick
  double body_max_n = 0;                                                          ///< largest force of the body on a tool
  /// Energy that the two ends of the coupling gave beyond what they had absorbed until then, at its largest.
  double generated_j = 0;
  double bound_j = 0;  ///< most that they may give: kForceMostN times the distance at the beginning
  std::vector<ClosedLoopResult> loops;

  bool stable() const { return !lost && guide.stable && guided.stable; }
};

inline constexpr double kGuidedBesideM = 0.010, kGuidedStrokeM = 0.040;

/// Throws InputError for an unknown hand, and what closed_loop() throws.
GuidedResult measure_guided(const Scene& scene, const GuidedPoint& point);

/// The points of the experiment: free and on the body, each hand, round trips of 0 to 300 ms, equal and unequal.
std::vector<GuidedPoint> guided_points(bool quick, std::uint64_t seed);

}  // namespace palpate
