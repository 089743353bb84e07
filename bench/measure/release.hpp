// The experiment of the paper's figure 18: a hand presses into a body and lets go of the device. The display then decides whether
// the device comes to rest.
//
// The hand (0.5 kg, 6 N s/m, 135 N/m) moves the grasped node by `depth_m` within 0.3 s (minimum jerk), stays, and lets go at 0.5
// s. The device has 75 g and by default no friction, so only the display can calm it. Its position is read in steps of 0.03 mm;
// its force is rendered exactly unless `force_step_n` is given (a Phantom has steps of 0.07 N).
// Source: Cavusoglu and Tendick, "Stability Implications".
#pragma once

#include "bench/measure/closed_loop.hpp"
#include "bench/measure/gestures.hpp"
#include "bench/measure/stability.hpp"

namespace palpate {

struct ReleaseOptions {
  Scheme scheme = Scheme::port;
  int order = 0;  ///< states, 0 = the scheme's default
  double rate_hz = 20;
  LinkSpec link;  ///< one way
  std::uint64_t seed = 1;
  Micros compute{};
  PassivityMode passivity = PassivityMode::off;  ///< off: the scheme alone
  Hand hand{0.5, 6, 135}, hand_after{};          ///< before the release, and the remaining grip after it
  double depth_m = 0.010;
  double tremor_m = 0, force_step_n = 0, device_damping_n_s_m = 0;
  double observe_s = 0;  ///< time after the release; 0: seven windows and two round trips
};

inline constexpr double kReleaseS = 0.5;

struct ReleaseResult {
  ClosedLoopResult loop;
  StabilityVerdict verdict;
  double depth_m = 0;        ///< depth of the tool at the release
  double display_min_j = 0;  ///< lowest energy of the display; below zero, it generates energy
  double hand_over_step_max_n = 0;
  double released_j = 0;  ///< energy of display and device at the release
};

/// Throws InputError if the scene's tool is no grasp or an option is out of range.
ReleaseResult release(const Scene& scene, const ReleaseOptions& options);

}  // namespace palpate
