#include "client/guard/guard.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/rotation_vector.hpp"

namespace palpate {

Guard::Guard(const GuardLimits& limits)
    : limits_(limits),
      heat_(limits.force_max_n, limits.force_continuous_n),
      torque_heat_(limits.torque_max_nm, limits.torque_continuous_nm) {}

Wrench Guard::pass(const Wrench& wrench, const ToolPose& tool, double dt_s, const Vec3& guidance) noexcept {
  if (!(dt_s > 0) || !std::isfinite(dt_s)) return last_;
  heat_.hold(last_.force.norm(), dt_s);
  torque_heat_.hold(last_.torque.norm(), dt_s);
  if (dt_s > kGapMaxS) restart();
  const bool seen = tool.position.allFinite() && tool.turn.coeffs().allFinite();
  SmallMotion moved;
  if (seen && has_tool_) {
    moved.way = tool.position - last_tool_.position;
    if (limits_.renders_torque) moved.angle = rotation_between(last_tool_.turn, tool.turn);
  }
  if (seen) last_tool_ = tool;
  has_tool_ = seen;
  const bool runs_off = too_fast(moved, dt_s);
  const Wrench shown = share_ * clamped(wrench), led = share_ * finite(guidance);
  share_ = std::clamp(share_ + (runs_off ? -1.0 / kStopTicks : 1.0 / kRampTicks), 0.0, 1.0);
  const Wrench damper = passive(shown, moved, dt_s);
  const Wrench out = finite(slewed(limited(shown + damper + led), dt_s));
  passivity_.rendered(out - led, damper);
  if (limits_.passivity != PassivityMode::off) counts_.energy_min_j = std::min(counts_.energy_min_j, passivity_.energy_j());
  last_ = out;
  return out;
}

void Guard::restart() noexcept {
  counts_.restarts += share_ > 0;
  passivity_.reset();
  last_ = {};
  has_tool_ = false;
  share_ = 0;
  ways_ = {};
}

/// Returns true when the tool's speed or rate of rotation over the last ticks exceeds the device's limit.
bool Guard::too_fast(const SmallMotion& moved, double dt_s) noexcept {
  newest_way_ = (newest_way_ + 1) % kSpeedTicks;
  ways_[newest_way_] = {moved, dt_s};
  SmallMotion sum;
  double time_s = 0;
  for (const Way& part : ways_) {
    sum.way += part.moved.way;
    sum.angle += part.moved.angle;
    time_s += part.dt_s;
  }
  const auto beyond = [&](const Vec3& way, double most_1_s) { return most_1_s > 0 && way.stableNorm() > most_1_s * time_s; };
  const bool fast = beyond(sum.way, limits_.velocity_max_m_s) || beyond(sum.angle, limits_.spin_max_rad_s);
  counts_.too_fast += fast;
  return fast;
}

Wrench Guard::finite(const Wrench& wrench) noexcept {
  if (wrench.finite()) return wrench;
  ++counts_.not_finite;
  return finite_parts(wrench);
}

/// Returns the wrench that the limiter adds.
Wrench Guard::passive(const Wrench& wrench, const SmallMotion& moved, double dt_s) noexcept {
  if (limits_.passivity == PassivityMode::off) return {};
  passivity_.observe(wrench, moved, dt_s);
  if (limits_.passivity != PassivityMode::on) return {};
  const Wrench damper = passivity_.damper(wrench);
  counts_.dissipated_j = passivity_.dissipated_j();
  if (damper.zero()) return damper;
  ++counts_.damped;
  counts_.damper_max_n = std::max(counts_.damper_max_n, damper.force.norm());
  counts_.damper_max_nm = std::max(counts_.damper_max_nm, damper.torque.norm());
  counts_.damper_sum_n2 += damper.force.squaredNorm();
  return damper;
}

Wrench Guard::clamped(const Wrench& wrench) noexcept {
  constexpr double kRounding = 1e-12;  // for a wrench that was clamped before
  const bool leaves_out = !limits_.renders_torque && !wrench.torque.isZero(0);
  counts_.torques_left_out += leaves_out;
  const Wrench asked = finite(leaves_out ? Wrench(wrench.force) : wrench);
  const double most_n = heat_.most_n(), most_nm = torque_heat_.most_n();
  const bool force = most_n > 0 && asked.force.stableNorm() > most_n * (1 + kRounding),
             torque = most_nm > 0 && asked.torque.stableNorm() > most_nm * (1 + kRounding);
  counts_.clamped += force || torque;
  counts_.heat_limited += (force && most_n < limits_.force_max_n) || (torque && most_nm < limits_.torque_max_nm);
  return limited(asked);
}

Wrench Guard::limited(const Wrench& wrench) const noexcept { return limited_to(wrench, heat_.most_n(), torque_heat_.most_n()); }

Wrench Guard::slewed(const Wrench& wrench, double dt_s) noexcept {
  const double time_s = std::min(dt_s, kSlewTickMaxS);
  const Wrench change = wrench - last_;
  const double share = share_within(change, limits_.slew_max_n_s * time_s, limits_.torque_slew_max_nm_s * time_s);
  if (share >= 1) return wrench;
  ++counts_.slew_limited;
  return last_ + share * change;
}

}  // namespace palpate
