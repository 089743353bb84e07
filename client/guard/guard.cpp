#include "client/guard/guard.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

Guard::Guard(const GuardLimits& limits) : limits_(limits), heat_(limits.force_max_n, limits.force_continuous_n) {}

Vec3 Guard::pass(const Vec3& force, const Vec3& tool_position, double dt_s, const Vec3& guidance) noexcept {
  if (!(dt_s > 0) || !std::isfinite(dt_s)) return last_force_;
  heat_.hold(last_force_.norm(), dt_s);
  if (dt_s > kGapMaxS) restart();
  const bool seen = tool_position.allFinite();
  const Vec3 dx = seen && has_position_ ? Vec3(tool_position - last_position_) : Vec3::Zero();
  if (seen) last_position_ = tool_position;
  has_position_ = seen;
  const bool runs_off = too_fast(dx, dt_s);
  const Vec3 shown = share_ * clamped(force), led = share_ * finite(guidance);
  share_ = std::clamp(share_ + (runs_off ? -1.0 / kStopTicks : 1.0 / kRampTicks), 0.0, 1.0);
  const Vec3 damper = passive(shown, dx, dt_s);
  const Vec3 out = finite(slewed(limited(shown + damper + led), dt_s));
  passivity_.rendered(out - led, damper);
  if (limits_.passivity != PassivityMode::off) counts_.energy_min_j = std::min(counts_.energy_min_j, passivity_.energy_j());
  last_force_ = out;
  return out;
}

void Guard::restart() noexcept {
  counts_.restarts += share_ > 0;
  passivity_.reset();
  last_force_ = Vec3::Zero();
  has_position_ = false;
  share_ = 0;
  ways_ = {};
}

/// Returns true when the tool's speed over the last ticks exceeds the device's limit.
bool Guard::too_fast(const Vec3& dx, double dt_s) noexcept {
  if (limits_.velocity_max_m_s <= 0) return false;
  newest_way_ = (newest_way_ + 1) % kSpeedTicks;
  ways_[newest_way_] = {dx, dt_s};
  Vec3 way = Vec3::Zero();
  double time_s = 0;
  for (const Way& part : ways_) {
    way += part.dx;
    time_s += part.dt_s;
  }
  const bool fast = way.stableNorm() > limits_.velocity_max_m_s * time_s;
  counts_.too_fast += fast;
  return fast;
}

Vec3 Guard::finite(const Vec3& force) noexcept {
  if (force.allFinite()) return force;
  ++counts_.not_finite;
  return Vec3::Zero();
}

/// Returns the force that the limiter adds.
Vec3 Guard::passive(const Vec3& force, const Vec3& dx, double dt_s) noexcept {
  if (limits_.passivity == PassivityMode::off) return Vec3::Zero();
  passivity_.observe(force, dx, dt_s);
  if (limits_.passivity != PassivityMode::on) return Vec3::Zero();
  const Vec3 damper = passivity_.damper(force);
  counts_.dissipated_j = passivity_.dissipated_j();
  if (damper.isZero(0)) return damper;
  ++counts_.damped;
  counts_.damper_max_n = std::max(counts_.damper_max_n, damper.norm());
  counts_.damper_sum_n2 += damper.squaredNorm();
  return damper;
}

Vec3 Guard::clamped(const Vec3& force) noexcept {
  constexpr double kRounding = 1e-12;  // for a force that was clamped before
  const Vec3 asked = finite(force);
  const double most_n = heat_.most_n();
  if (most_n > 0 && asked.stableNorm() > most_n * (1 + kRounding)) {
    ++counts_.clamped;
    counts_.heat_limited += most_n < limits_.force_max_n;
  }
  return limited(asked);
}

Vec3 Guard::limited(const Vec3& force) const noexcept {
  const double norm = force.stableNorm(), most_n = heat_.most_n();
  return most_n <= 0 || norm <= most_n ? force : Vec3((most_n / norm) * force);
}

Vec3 Guard::slewed(const Vec3& force, double dt_s) noexcept {
  const double change_max_n = limits_.slew_max_n_s * std::min(dt_s, kSlewTickMaxS);
  const Vec3 change = force - last_force_;
  const double norm = change.stableNorm();
  if (limits_.slew_max_n_s <= 0 || norm <= change_max_n) return force;
  ++counts_.slew_limited;
  return last_force_ + (change_max_n / norm) * change;
}

}  // namespace palpate
