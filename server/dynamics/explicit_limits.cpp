#include "server/dynamics/explicit_limits.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "server/dynamics/chebyshev.hpp"

namespace palpate {
namespace {

/// Returns the magnitude of the largest eigenvalue of one step of leapfrog on (x, h v, h^2 a).
double leapfrog_growth(double w2, double g, double h) {
  const double w = h * h * w2, z = h * g;
  Mat3 step;
  step.row(2) << -w, -z, -z / 2;
  step.row(1) = Eigen::RowVector3d(0, 1, 0) + step.row(2);
  step.row(0) = Eigen::RowVector3d(1, 0, 0) + step.row(1);
  return step.eigenvalues().cwiseAbs().maxCoeff();
}

/// Returns the longest step, up to `longest_s`, in which no mode grows; 0: none that would be worth it.
double reach_of(const Chebyshev& method, const Spectrum& spectrum, double longest_s) {
  constexpr double kReach = 0.7, kShorter = 0.95, kLeast = 0.1;
  const double s = static_cast<double>(method.stages.size());
  const double begin_s = std::min(longest_s, kReach * s * s / spectrum.g);
  for (double h = begin_s; h > kLeast * begin_s; h *= kShorter)
    if (method.is_stable(spectrum, h)) return h;
  return 0;
}

}  // namespace

double leapfrog_step_s(double w2, double g) {
  constexpr double kRounding = 1e-9, kLongest = 1;
  double stable = 0, unstable = kLongest;
  if (leapfrog_growth(w2, g, unstable) <= 1 + kRounding) return kLongest;
  for (int k = 0; k < 60; ++k) {
    const double h = 0.5 * (stable + unstable);
    (leapfrog_growth(w2, g, h) <= 1 + kRounding ? stable : unstable) = h;
  }
  return stable;
}

ExplicitLimits::ExplicitLimits(const Dynamics& dynamics)
    : spectrum(spectrum_of(dynamics)), leapfrog_s(kShare * leapfrog_step_s(spectrum.w2, spectrum.g)) {
  for (int s = kFewestStages; s <= kMostStages; ++s)
    chebyshev_s.push_back(kShare * reach_of(Chebyshev(s), spectrum, kLongestS / kShare));
}

}  // namespace palpate
