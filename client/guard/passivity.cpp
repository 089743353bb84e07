#include "client/guard/passivity.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {
constexpr double kRestForceN = 1e-6;
constexpr double kSkippedS = 1.5e-3;  // a longer tick than this was more than one
}  // namespace

double Passivity::observe(const Vec3& force, const Vec3& dx, double dt_s) noexcept {
  newest_ = (newest_ + 1) % kWindow;
  steps_[newest_] = {dx, dt_s};
  const Vec3 shown = dt_s > kSkippedS ? force_ : Vec3(0.5 * force_ + 0.5 * force);
  const double gained = -(shown + damper_).dot(dx), damped = -damper_.dot(dx);
  if (std::isfinite(damped)) dissipated_j_ += damped;
  if (std::isfinite(gained)) energy_j_ = std::clamp(energy_j_ + gained, -kEnergyMaxJ, kEnergyMaxJ);
  rest_ticks_ = force.squaredNorm() < kRestForceN * kRestForceN ? std::min(rest_ticks_ + 1, kRestTicks) : 0;
  if (rest_ticks_ == kRestTicks) {
    energy_j_ = 0;
    returns_ = true;
    return_ticks_ = 0;
  }
  return energy_j_;
}

Vec3 Passivity::damper(const Vec3& force) noexcept {
  if (returns_ && energy_j_ < -kFullJ) energy_j_ = std::min(energy_j_ + kReturnW * steps_[newest_].dt_s, -kFullJ);
  const double weakened_by = weakened();
  if (returns_ && rest_ticks_ == 0) ++return_ticks_;
  if (return_ticks_ > kReturnTicks && weakened_by == 0) returns_ = false;
  const Vec3 left = (1 - weakened_by) * force;
  return damped(left) + (left - force);
}

/// w above.
double Passivity::weakened() const noexcept {
  if (!returns_) return 0;
  return std::clamp((-energy_j_ - kFullJ) / (kReturnFullJ - kFullJ), 0.0, 1.0);
}

Vec3 Passivity::damped(const Vec3& force) const noexcept {
  const double deficit_j = -energy_j_ - kToleranceJ, force_n = force.stableNorm();
  if (!(deficit_j > 0) || !(force_n > 0) || !std::isfinite(force_n)) return Vec3::Zero();
  Vec3 way = Vec3::Zero();
  double time_s = 0;
  for (std::size_t n = 0; n < kWindow && way.squaredNorm() < kWayM * kWayM; ++n) {
    const Step& step = steps_[(newest_ + kWindow - n) % kWindow];
    way += step.dx;
    time_s += step.dt_s;
  }
  const Vec3 along = force / force_n;
  const double alpha = std::min(kAlphaMaxNSM, kDeviceKg / (time_s + steps_[newest_].dt_s));
  const double wanted_n = alpha * way.dot(along) / time_s, most_n = std::min(1.0, deficit_j / kFullJ) * force_n;
  return -std::clamp(wanted_n, -most_n, most_n) * along;
}

void Passivity::rendered(const Vec3& force, const Vec3& damper) noexcept {
  force_ = force;
  damper_ = damper;
}

void Passivity::reset() noexcept {
  const double dissipated_j = dissipated_j_;
  *this = Passivity{};
  dissipated_j_ = dissipated_j;
}

}  // namespace palpate
