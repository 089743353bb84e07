#include "client/guard/motor_heat.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

void MotorHeat::hold(double force_n, double dt_s) noexcept {
  if (!limits()) return;
  const double loss = force_n * force_n / (continuous_n_ * continuous_n_);
  heat_ += (heat_ - loss) * std::expm1(-dt_s / kTimeS);
}

double MotorHeat::most_n() const noexcept {
  if (!limits()) return peak_n_;
  const double left = std::clamp((1 - heat_) / kBand, 0.0, 1.0), rated_n2 = continuous_n_ * continuous_n_;
  return std::sqrt(rated_n2 + (peak_n_ * peak_n_ - rated_n2) * left);
}

}  // namespace palpate
