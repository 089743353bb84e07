#include "client/guard/passivity.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {
constexpr double kRestForceN = 1e-6;
constexpr double kHeldS = 1e-3;       // time for which a force is shown, however late the previous tick was
constexpr double kAheadS = 2e-3;      // time until the current force has been judged
constexpr double kSkippedS = 1.5e-3;  // a longer tick counts as more than one

/// Returns the p in [0, 1] for which |way + p step| = length, 1 if there is none; |way| < length.
double share_to(double length, const Vec3& way, const Vec3& step) noexcept {
  const double a = step.squaredNorm(), b = way.dot(step), c = way.squaredNorm() - length * length;
  return (way + step).squaredNorm() > length * length ? (std::sqrt(b * b - a * c) - b) / a : 1;
}
}  // namespace

void Passivity::observe(const Vec3& force, const Vec3& dx, double dt_s) noexcept {
  newest_ = (newest_ + 1) % kWindow;
  steps_[newest_] = {dx, dt_s};
  if (const double damped = -damper_.dot(dx); std::isfinite(damped)) dissipated_j_ += damped;
  expected_ = force + damper_;
  half_way_ = dt_s > kSkippedS ? Vec3(Vec3::Zero()) : Vec3(0.5 * dx);
  gain(-force_.dot(dx - half_way_) - expected_.dot(half_way_));
  rest_ticks_ = force.squaredNorm() < kRestForceN * kRestForceN ? std::min(rest_ticks_ + 1, kRestTicks) : 0;
  if (rest_ticks_ == kRestTicks) energy_j_ = 0;
}

void Passivity::gain(double energy_j) noexcept {
  if (std::isfinite(energy_j)) energy_j_ = std::clamp(energy_j_ + energy_j, -kEnergyMaxJ, kEnergyMaxJ);
}

Vec3 Passivity::damper(const Vec3& force) noexcept {
  if (energy_j_ < -kFullJ) energy_j_ = std::min(energy_j_ + kReturnW * steps_[newest_].dt_s, -kFullJ);
  return damped(force) - weakened() * force;
}

/// Returns w of the header.
double Passivity::weakened() const noexcept {
  const Vec3 asked = expected_ - damper_;
  const Step& step = steps_[newest_];  // not a mean, which would be late
  const double ahead_j = std::max(0.0, kAheadS * asked.dot(step.dx) / step.dt_s - kFullJ);
  return std::clamp((ahead_j - energy_j_ - kFullJ) / (kMostJ - kFullJ), 0.0, 1.0);
}

Passivity::Motion Passivity::motion() const noexcept {
  Vec3 way = Vec3::Zero();
  double time_s = 0;
  for (std::size_t n = 0; n < kWindow && way.squaredNorm() < kWayM * kWayM; ++n) {
    const Step& step = steps_[(newest_ + kWindow - n) % kWindow];
    const double share = n > 0 ? share_to(kWayM, way, step.dx) : 1;
    way += share * step.dx;
    time_s += share * step.dt_s;
  }
  return {way / time_s, std::min(kAlphaMaxNSM, kDeviceKg / (time_s + kHeldS))};
}

/// Returns the target of F_damper, without the part `weaker`.
Vec3 Passivity::damped(const Vec3& force) noexcept {
  const double force_n = force.stableNorm();
  const Vec3 goal = force_n > 0 && std::isfinite(force_n) ? drag(force, force_n) : Vec3(Vec3::Zero());
  const Vec3 half = 0.5 * drag_ + 0.5 * goal;
  drag_ = half.dot(steps_[newest_].dx) > 0 || half.norm() > force_n ? goal : half;
  return drag_;
}

Vec3 Passivity::drag(const Vec3& force, double force_n) const noexcept {
  const double deficit_j = -energy_j_ - kToleranceJ;
  if (!(deficit_j > 0)) return Vec3::Zero();
  const auto [velocity, alpha] = motion();
  const Vec3 along = force / force_n;
  const double left_n = (1 - weakened()) * force_n, v = velocity.dot(along);
  const double next_j = std::clamp(force_n * v * kHeldS, 0.0, 0.25 * kFullJ);  // E_h of the header
  const double share = std::min(1.0, deficit_j / (kFullJ - next_j));
  const double along_n = std::clamp(alpha * v, -share * force_n, share * left_n);
  const double power_w = (left_n - along_n) * v;
  if (!(power_w > 0)) return -along_n * along;
  const Vec3 across = velocity - v * along;
  const double beta = std::min(alpha, power_w / across.squaredNorm());
  return -along_n * along - share * beta * across;
}

void Passivity::rendered(const Vec3& force, const Vec3& damper) noexcept {
  gain(-(force - expected_).dot(half_way_));
  half_way_ = Vec3::Zero();
  force_ = force;
  damper_ = damper;
}

void Passivity::reset() noexcept {
  const double dissipated_j = dissipated_j_;
  *this = Passivity{};
  dissipated_j_ = dissipated_j;
}

}  // namespace palpate
