#include "client/guard/guard.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

Guard::Guard(const GuardLimits& limits) : limits_(limits) {}

Vec3 Guard::pass(const Vec3& force, const Vec3& tool_position, double dt_s) noexcept {
  if (!(dt_s > 0) || !std::isfinite(dt_s)) return last_force_;
  const Vec3 shown = clamped(force);
  const Vec3 damper = passive(shown, tool_position, dt_s);
  const Vec3 out = finite(slewed(limited(shown + damper), dt_s));
  passivity_.rendered(out - damper, damper);
  last_force_ = out;
  return out;
}

void Guard::reset() noexcept {
  passivity_.reset();
  last_force_ = Vec3::Zero();
  has_position_ = false;
}

Vec3 Guard::finite(const Vec3& force) noexcept {
  if (force.allFinite()) return force;
  ++counts_.not_finite;
  return Vec3::Zero();
}

/// The force that the limiter adds.
Vec3 Guard::passive(const Vec3& force, const Vec3& tool_position, double dt_s) noexcept {
  if (limits_.passivity == PassivityMode::off) return Vec3::Zero();
  const bool seen = tool_position.allFinite(), moved = seen && has_position_;
  const Vec3 dx = moved ? Vec3(tool_position - last_position_) : Vec3::Zero();
  if (seen) last_position_ = tool_position;
  has_position_ = seen;
  counts_.energy_min_j = std::min(counts_.energy_min_j, passivity_.observe(force, dx, dt_s));
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
  constexpr double kRounding = 1e-12;  // of a force that was clamped before
  const Vec3 asked = finite(force);
  if (limits_.force_max_n > 0 && asked.stableNorm() > limits_.force_max_n * (1 + kRounding)) ++counts_.clamped;
  return limited(asked);
}

Vec3 Guard::limited(const Vec3& force) const noexcept {
  const double norm = force.stableNorm();
  return limits_.force_max_n <= 0 || norm <= limits_.force_max_n ? force : Vec3((limits_.force_max_n / norm) * force);
}

Vec3 Guard::slewed(const Vec3& force, double dt_s) noexcept {
  const double change_max_n = limits_.slew_max_n_s * dt_s;
  const Vec3 change = force - last_force_;
  const double norm = change.stableNorm();
  if (limits_.slew_max_n_s <= 0 || norm <= change_max_n) return force;
  ++counts_.slew_limited;
  return last_force_ + (change_max_n / norm) * change;
}

}  // namespace palpate
