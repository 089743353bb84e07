#include "client/guard/passivity.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {
constexpr double kRestForceN = 1e-6;
constexpr double kHeldS = 1e-3;       // time for which a force is shown, however late the previous tick was
constexpr double kAheadS = 2e-3;      // time until the current force has been judged
constexpr double kSkippedS = 1.5e-3;  // a longer tick counts as more than one
}  // namespace

double Passivity::Six::norm() const { return std::sqrt(square()); }
double Passivity::Six::stable_norm() const { return std::hypot(linear.stableNorm(), angular.stableNorm()); }

/// Returns the p in [0, 1] for which |way + p step| = length, 1 if there is none; |way| < length.
double Passivity::share_to(double length, const Six& way, const Six& step) noexcept {
  const double a = step.square(), b = way.dot(step), c = way.square() - length * length;
  return (way + step).square() > length * length ? (std::sqrt(b * b - a * c) - b) / a : 1;
}

void Passivity::observe(const Wrench& wrench, const SmallMotion& moved, double dt_s) noexcept {
  const Six force = Six::of(wrench), dx = Six::of(moved);
  newest_ = (newest_ + 1) % kWindow;
  steps_[newest_] = {dx, dt_s};
  if (const double damped = -damper_.dot(dx); std::isfinite(damped)) dissipated_j_ += damped;
  expected_ = force + damper_;
  half_way_ = dt_s > kSkippedS ? Six() : 0.5 * dx;
  gain(-force_.dot(dx - half_way_) - expected_.dot(half_way_));
  rest_ticks_ = force.square() < kRestForceN * kRestForceN ? std::min(rest_ticks_ + 1, kRestTicks) : 0;
  if (rest_ticks_ == kRestTicks) energy_j_ = 0;
}

void Passivity::gain(double energy_j) noexcept {
  if (std::isfinite(energy_j)) energy_j_ = std::clamp(energy_j_ + energy_j, -kEnergyMaxJ, kEnergyMaxJ);
}

Wrench Passivity::damper(const Wrench& wrench) noexcept {
  const Six force = Six::of(wrench);
  if (energy_j_ < -kFullJ) energy_j_ = std::min(energy_j_ + kReturnW * steps_[newest_].dt_s, -kFullJ);
  return (damped(force) - weakened() * force).wrench();
}

/// Returns w of the header.
double Passivity::weakened() const noexcept {
  const Six asked = expected_ - damper_;
  const Step& step = steps_[newest_];  // not a mean, which would be late
  const double ahead_j = std::max(0.0, kAheadS * asked.dot(step.dx) / step.dt_s - kFullJ);
  return std::clamp((ahead_j - energy_j_ - kFullJ) / (kMostJ - kFullJ), 0.0, 1.0);
}

Passivity::Motion Passivity::motion() const noexcept {
  Six way;
  double time_s = 0;
  for (std::size_t n = 0; n < kWindow && way.square() < kWayM * kWayM; ++n) {
    const Step& step = steps_[(newest_ + kWindow - n) % kWindow];
    const double share = n > 0 ? share_to(kWayM, way, step.dx) : 1;
    way = way + share * step.dx;
    time_s += share * step.dt_s;
  }
  return {way / time_s, std::min(kAlphaMaxNSM, kDeviceKg / (time_s + kHeldS))};
}

/// Returns the target of F_damper, without the part `weaker`.
Passivity::Six Passivity::damped(const Six& force) noexcept {
  const double force_n = force.stable_norm();
  const Six goal = force_n > 0 && std::isfinite(force_n) ? drag(force, force_n) : Six();
  const Six half = 0.5 * drag_ + 0.5 * goal;
  drag_ = half.dot(steps_[newest_].dx) > 0 || half.norm() > force_n ? goal : half;
  return drag_;
}

Passivity::Six Passivity::drag(const Six& force, double force_n) const noexcept {
  const double deficit_j = -energy_j_ - kToleranceJ;
  if (!(deficit_j > 0)) return {};
  const auto [velocity, alpha] = motion();
  const Six along = force / force_n;
  const double left_n = (1 - weakened()) * force_n, v = velocity.dot(along);
  const double next_j = std::clamp(force_n * v * kHeldS, 0.0, 0.25 * kFullJ);  // E_h of the header
  const double share = std::min(1.0, deficit_j / (kFullJ - next_j));
  const double along_n = std::clamp(alpha * v, -share * force_n, share * left_n);
  const double power_w = (left_n - along_n) * v;
  if (!(power_w > 0)) return -along_n * along;
  const Six across = velocity - v * along;
  const double beta = std::min(alpha, power_w / across.square());
  return -along_n * along - share * beta * across;
}

void Passivity::rendered(const Wrench& wrench, const Wrench& damper) noexcept {
  const Six force = Six::of(wrench);
  gain(-(force - expected_).dot(half_way_));
  half_way_ = {};
  force_ = force;
  damper_ = Six::of(damper);
}

void Passivity::reset() noexcept {
  const double dissipated_j = dissipated_j_;
  *this = Passivity{};
  dissipated_j_ = dissipated_j;
}

}  // namespace palpate
