// The points of the stability sweep. docs/results/stability.md says why these.
#pragma once

#include <vector>

#include "bench/measure/body_trial.hpp"
#include "bench/measure/stability_point.hpp"

namespace palpate {

struct StabilityPlan {
  std::vector<Scheme> schemes;
  double body_n_m = 0;  ///< static stiffness of the body as it is, grasped
  bool quick = false;
  std::uint64_t seed = 1;  ///< of the scattered points and of the links
};

/// Static stiffnesses at the port [N/m]: from soft tissue to the stiffest contact that a Phantom renders at 1 kHz, among them the
/// body as it is.
std::vector<double> stability_stiffnesses(double body_n_m);
inline constexpr std::array<double, 6> kStabilityRttMs{0, 50, 100, 200, 400, 1000};

/// The two ways of meeting the body through which the axes are mapped: a grasp that is let go of (figure 18 of the paper), and
/// taps of a light hand.
StabilityPoint map_base(ContactKind contact, double body_n_m);

/// Each point once, in an order that depends on the plan alone.
std::vector<StabilityPoint> stability_points(const StabilityPlan& plan);

/// What the full model is put through: the corners of the space, and `scattered` trials that fill it evenly.
std::vector<BodyTrial> body_trials(std::size_t scattered, std::uint64_t seed);

}  // namespace palpate
