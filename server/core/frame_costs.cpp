#include "server/core/frame_costs.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

void FrameCosts::Mean::take(double sample_s) {
  constexpr double kLeastS = 1e-6;  // a measured cost is never 0, which means unknown
  const double sample = std::max(sample_s, kLeastS);
  ++taken;
  if (taken <= kFirst)
    mean_s = taken == 1 ? sample : std::min(mean_s, sample);
  else
    mean_s += (std::min(sample, 4 * mean_s) - mean_s) / 8;
}

void FrameCosts::Mean::forget(Micros passed) {
  const double kept = std::exp2(-seconds(passed) / seconds(kForgotten));
  mean_s *= kept;
  expected_s *= kept;
}

void FrameCosts::expect(const Expected& costs) {
  step_.expected_s = seconds(costs.step);
  linear_.expected_s = seconds(costs.linear);
  nonlinear_.expected_s = seconds(costs.nonlinear);
  rollouts_.expected_s = seconds(costs.rollouts);
}

void FrameCosts::take_step(Micros took) { step_.take(seconds(took)); }

void FrameCosts::take_patches(const Patches& patches, Micros passed) {
  if (patches.rollouts > Micros{})
    rollouts_.take(seconds(patches.rollouts));
  else
    rollouts_.forget(passed);
  const double took_s = seconds(patches.took - patches.rollouts);
  if (patches.nonlinear == 0) {
    nonlinear_.forget(passed);
    if (patches.linear > 0) linear_.take(took_s / patches.linear);
    return;
  }
  // In a frame with both kinds, the linear patches are assumed to cost their mean.
  nonlinear_.take((took_s - patches.linear * linear_.mean_s) / patches.nonlinear);
}

}  // namespace palpate
