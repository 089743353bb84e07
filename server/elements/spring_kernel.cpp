#include "server/elements/spring_kernel.hpp"

#include <cmath>

namespace palpate {
namespace {

// f(x) = x / (p - q x), x in mm and f in N, p and q being skin_p and skin_q; continued along its tangent beyond 90 % of the pole
// at p / q.
constexpr double skin_p = 5.4398, skin_q = 0.1418, skin_end = 0.9 * skin_p / skin_q;

SpringResponse thigh_skin(double x_m) {
  const double sign = x_m < 0 ? -1.0 : 1.0;
  const double x = std::abs(x_m) * 1e3;
  const double at = std::min(x, skin_end);
  const double slope = skin_p / ((skin_p - skin_q * at) * (skin_p - skin_q * at));
  const double force = at / (skin_p - skin_q * at) + slope * (x - at);
  return {sign * force, slope * 1e3};
}

/// Returns the integral of f from 0 [J].
double thigh_skin_energy(double x_m) {
  const double x = std::abs(x_m) * 1e3, at = std::min(x, skin_end), beyond = x - at;
  const double u = skin_q * at / skin_p;
  // Series of -u - ln(1 - u) for small u, where the terms cancel.
  const double curve = u < 1e-3 ? u * u * (1.0 / 2 + u * (1.0 / 3 + u / 4)) : -u - std::log1p(-u);
  const double slope = skin_p / ((skin_p - skin_q * at) * (skin_p - skin_q * at));
  return 1e-3 * (skin_p / (skin_q * skin_q) * curve + beyond * (at / (skin_p - skin_q * at) + slope * beyond / 2));
}

}  // namespace

SpringResponse spring_response(SpringLaw law, double stiffening, const Element& element, double elongation_m) {
  const double k = element.stiffness_n_m;
  switch (law) {
    case SpringLaw::linear:
      break;
    case SpringLaw::stiffening: {
      const double strain = elongation_m / element.rest_length_m;
      const double growth = stiffening * strain * strain;
      return {k * elongation_m * (1 + growth), k * (1 + 3 * growth)};
    }
    case SpringLaw::thigh_skin: {
      const SpringResponse unit = thigh_skin(elongation_m);
      const double scale = k / thigh_skin(0).slope;
      return {scale * unit.tension, scale * unit.slope};
    }
  }
  return {k * elongation_m, k};
}

double spring_energy(SpringLaw law, double stiffening, const Element& element, double elongation_m) {
  const double linear = 0.5 * element.stiffness_n_m * elongation_m * elongation_m;
  switch (law) {
    case SpringLaw::linear:
      break;
    case SpringLaw::stiffening: {
      const double strain = elongation_m / element.rest_length_m;
      return linear * (1 + 0.5 * stiffening * strain * strain);
    }
    case SpringLaw::thigh_skin:
      return element.stiffness_n_m / thigh_skin(0).slope * thigh_skin_energy(elongation_m);
  }
  return linear;
}

bool is_smooth(SpringLaw law) { return law != SpringLaw::thigh_skin; }

SpringSeries spring_series(SpringLaw law, double stiffening, const Element& element, double elongation_m) {
  const SpringResponse r = spring_response(law, stiffening, element, elongation_m);
  const double length2 = element.rest_length_m * element.rest_length_m;
  const bool stiffens = law == SpringLaw::stiffening;
  return {r.tension, r.slope, stiffens ? 6 * element.stiffness_n_m * stiffening / length2 * elongation_m : 0.0};
}

}  // namespace palpate
