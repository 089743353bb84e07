#include "bench/paper/braking_pulse.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kRestM = 1e-4;

/// Remaining part of the momentum at contact.
struct Pulse {
  double force_n = 0;
  int periods = 0;
};

Pulse pulse_for(const Impact& impact, double speed_m_s) {
  const double momentum = impact.device.mass_kg * std::max(0.0, speed_m_s);
  const int periods = std::max(1, static_cast<int>(std::ceil(momentum / (impact.period_s * impact.force_max_n))));
  return {momentum / (periods * impact.period_s), periods};
}

void summarise(const Impact& impact, std::size_t contact, ImpactResult& r) {
  const double balance = std::min(impact.push_n, impact.force_max_n) / impact.wall_n_m;
  std::size_t last = contact;
  for (std::size_t n = contact; n < r.position_m.size(); ++n) {
    r.depth_max_m = std::max(r.depth_max_m, r.position_m[n]);
    r.bounce_max_m = std::max(r.bounce_max_m, -r.position_m[n]);
    if (std::abs(r.position_m[n] - balance) > kRestM) last = n;
  }
  r.rest_ms = static_cast<double>(last - contact) * impact.period_s * 1e3;
  const auto window = static_cast<std::size_t>(std::max(1.0, std::round(kRateWindowS / impact.period_s)));
  double most = 0;
  for (std::size_t n = contact; n < std::min(contact + window, r.force_n.size()); ++n) most = std::max(most, r.force_n[n]);
  r.rate_hardness_n_m = most / (static_cast<double>(window) * impact.period_s) / impact.speed_m_s;
}

}  // namespace

ImpactResult hit(const Impact& impact) {
  const double dt = impact.period_s;
  const DeviceStep step(impact.device, dt);
  ImpactResult r;
  double x = -1.5 * impact.speed_m_s * dt, v = impact.speed_m_s, before = x - v * dt;
  std::size_t contact = 0;
  Pulse pulse;
  const auto samples = static_cast<std::size_t>(std::lround(impact.duration_s / dt));
  for (std::size_t n = 0; n < samples; ++n) {
    const double speed = (x - before) / dt;
    if (x > 0 && before <= 0) {
      if (++r.contacts == 1) contact = n;
      // Every contact is braked; the first one is reported.
      if (impact.pulse) pulse = pulse_for(impact, speed);
      if (r.contacts == 1) r.pulse_periods = pulse.periods;
    }
    double force = x > 0 ? std::max(0.0, impact.wall_n_m * x + impact.wall_n_s_m * speed) : 0.0;
    if (pulse.periods > 0) {
      force += pulse.force_n;
      --pulse.periods;
      if (r.contacts == 1) r.pulse_impulse_n_s += pulse.force_n * dt;
    }
    force = std::min(force, impact.force_max_n);
    r.position_m.push_back(x);
    r.force_n.push_back(force);
    before = x;
    step.advance(impact.push_n - force, x, v);
  }
  if (r.contacts > 0) summarise(impact, contact, r);
  return r;
}

}  // namespace palpate
