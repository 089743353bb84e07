#include "server/body/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

/// Returns the largest eigenvalue of M^-1 K (or D) by power iteration, from a start with components in all modes.
double largest(const Dynamics& dynamics, const BodyState& rest, bool of_damping) {
  constexpr int kIterations = 60;
  constexpr double kFromBelow = 1.03;  // margin for the remaining error, which is from below
  Vector y(rest.x.size()), k_y, d_y;
  for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = i % 2 == 0 ? 1.0 : -0.7 + 0.01 * static_cast<double>(i % 13);
  double value = 0;
  for (int k = 0; k < kIterations; ++k) {
    mask(dynamics.body().fixed, y);
    y /= std::sqrt(std::max(y.dot(dynamics.masses().cwiseProduct(y)), 1e-300));
    dynamics.multiply_tangents(rest, y, k_y, d_y);
    const Vector& image = of_damping ? d_y : k_y;
    value = y.dot(image);
    if (!(value > 0)) return 0;
    y = image.cwiseQuotient(dynamics.masses());
  }
  return kFromBelow * value;
}

}  // namespace

std::pair<double, double> damping_times(const LumpedBody& body) {
  double least_s = std::numeric_limits<double>::infinity(), most_s = 0;
  for (const Element& e : body.elements) {
    least_s = std::min(least_s, e.damping_n_s_m / e.stiffness_n_m);
    most_s = std::max(most_s, e.damping_n_s_m / e.stiffness_n_m);
  }
  for (const SolidMaterial& m : body.materials) {
    least_s = std::min(least_s, m.damping_s);
    most_s = std::max(most_s, m.damping_s);
  }
  return {least_s, most_s};
}

Spectrum spectrum_of(const Dynamics& dynamics) {
  const BodyState rest = dynamics.rest_state();
  const Contacts& contacts = dynamics.contacts();
  Spectrum spectrum;
  const double stiffer = dynamics.body().is_solid() ? Spectrum::kSolidStiffer : Spectrum::kStiffer;
  spectrum.w2 = stiffer * largest(dynamics, rest, false) + contacts.most_w2();
  spectrum.g = Spectrum::kThicker * largest(dynamics, rest, true) + contacts.most_g();
  const auto [least_s, most_s] = damping_times(dynamics.body());
  spectrum.least_s = least_s / stiffer;
  spectrum.most_s = Spectrum::kThicker * most_s;
  return spectrum;
}

}  // namespace palpate
