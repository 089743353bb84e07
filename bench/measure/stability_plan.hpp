// Points of the stability sweep. docs/results/stability.md explains the choice.
#pragma once

#include <vector>

#include "bench/measure/body_trial.hpp"
#include "bench/measure/stability_point.hpp"

namespace palpate {

struct StabilityPlan {
  std::vector<Scheme> schemes;
  double body_n_m = 0;  ///< static stiffness of the unscaled body, grasped
  bool quick = false;
  std::uint64_t seed = 1;  ///< seed of the scattered points and of the links
};

/// Static stiffnesses at the port [N/m]: from soft tissue to the stiffest contact that a Phantom renders at 1 kHz, including that
/// of the unscaled body.
std::vector<double> stability_stiffnesses(double body_n_m);
inline constexpr std::array<double, 6> kStabilityRttMs{0, 50, 100, 200, 400, 1000};

/// The two kinds of contact for which the axes are mapped: a grasp that is released (figure 18 of the paper), and taps of a light
/// hand.
StabilityPoint map_base(ContactKind contact, double body_n_m);

/// Each point once, in an order that depends on the plan alone.
std::vector<StabilityPoint> stability_points(const StabilityPlan& plan);

/// Points with 2 to 8 hands that touch one body, 0 to kApartMostMm from each other, with round trips of 0 to 300 ms that are
/// equal or not: taps of light hands and presses of firm ones. `body_n_m`: stiffness of the touched body.
std::vector<StabilityPoint> hands_points(const StabilityPlan& plan);
inline constexpr double kApartMostMm = 100;

/// Points with one hand and a tool that has a body, or a needle: each with every gesture that it has, against the round trip and
/// at the corners of stiffness and rate, and scattered ones. Schemes that have no torque are left out.
std::vector<StabilityPoint> tool_points(const StabilityPlan& plan);

/// Trials of the full model: the corners of the space, and `scattered` trials that fill it evenly.
std::vector<BodyTrial> body_trials(std::size_t scattered, std::uint64_t seed);

}  // namespace palpate
