// The longest steps in which explicit methods are stable for a body, at small strains.
#pragma once

#include <vector>

#include "server/body/spectrum.hpp"

namespace palpate {

/// Returns the largest stable step of leapfrog for one mode [s]: w2 = w^2 [1/s^2], g [1/s].
double leapfrog_step_s(double w2, double g);

struct ExplicitLimits {
  static constexpr int kFewestStages = 2, kMostStages = 24;
  static constexpr double kLongestS = 0.004;
  static constexpr double kShare = 0.9;  ///< share of the stable step that is used

  Spectrum spectrum;
  double leapfrog_s = 0;            ///< of leapfrog, times kShare
  std::vector<double> chebyshev_s;  ///< of Runge-Kutta-Chebyshev with kFewestStages ... kMostStages, times kShare; 0: none

  explicit ExplicitLimits(const Dynamics& dynamics);
};

}  // namespace palpate
