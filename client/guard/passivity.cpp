#include "client/guard/passivity.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {
constexpr double kRestForceN = 1e-6;
}

double Passivity::observe(const Vec3& force, const Vec3& dx) noexcept {
  const double gained = -(0.5 * force_ + 0.5 * force + damper_).dot(dx), damped = -damper_.dot(dx);
  if (std::isfinite(damped)) dissipated_j_ += damped;
  if (std::isfinite(gained)) energy_j_ = std::clamp(energy_j_ + gained, -kEnergyMaxJ, kEnergyMaxJ);
  rest_ticks_ = force.squaredNorm() < kRestForceN * kRestForceN ? std::min(rest_ticks_ + 1, kRestTicks) : 0;
  if (rest_ticks_ == kRestTicks) energy_j_ = 0;
  return energy_j_;
}

Vec3 Passivity::damper(const Vec3& dx, double dt_s) const noexcept {
  const double travelled_m2 = dx.squaredNorm();
  if (energy_j_ >= -kToleranceJ || !(travelled_m2 > 0)) return Vec3::Zero();
  const double alpha = std::min(kAlphaMaxNSM, -energy_j_ * dt_s / travelled_m2);
  return -alpha / dt_s * dx;
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
