#include <catch2/catch.hpp>
#include <cmath>

#include "bench/paper/braking_pulse.hpp"

using namespace palpate;

TEST_CASE("the pulse takes the device's momentum, in as few ticks as its force allows", "[paper]") {
  for (const double speed : {0.05, 0.2, 0.4}) {
    Impact impact;
    impact.pulse = true;
    impact.speed_m_s = speed;
    impact.push_n = 0;
    impact.device.damping_n_s_m = 0;
    const ImpactResult r = hit(impact);
    const double momentum = 0.075 * speed;
    CHECK(r.pulse_impulse_n_s == Approx(momentum).epsilon(1e-9));
    CHECK(r.pulse_periods == static_cast<int>(std::ceil(momentum / 8.5e-3)));
    for (const double f : r.force_n) CHECK(f <= 8.5);
  }
}

TEST_CASE("on a wall without stiffness the pulse alone stops the device", "[paper]") {
  Impact impact;
  impact.pulse = true;
  impact.wall_n_m = 1e-9;
  impact.push_n = 0;
  impact.device.damping_n_s_m = 0;
  impact.duration_s = 0.05;
  const ImpactResult r = hit(impact);
  const std::size_t end = r.position_m.size();
  CHECK(r.position_m[end - 1] - r.position_m[end - 2] == Approx(0).margin(1e-15));
  CHECK(r.contacts == 1);
}

TEST_CASE("without a pulse the device sinks in as energy says and bounces back faster: sampling feeds it", "[paper]") {
  Impact impact;
  impact.push_n = 0;
  impact.device.damping_n_s_m = 0;
  impact.wall_n_m = 100;
  const ImpactResult r = hit(impact);
  CHECK(r.depth_max_m == Approx(0.2 * std::sqrt(0.075 / 100)).epsilon(0.03));
  const std::size_t end = r.position_m.size();
  CHECK((r.position_m[end - 2] - r.position_m[end - 1]) / 1e-3 > 0.2);
}

TEST_CASE("with the pulse a wall is hit harder, sunk into less and not bounced off", "[paper]") {
  Impact without;
  without.wall_n_m = 800;
  Impact with = without;
  with.pulse = true;
  const ImpactResult a = hit(without), b = hit(with);
  CHECK(b.rate_hardness_n_m > 10 * a.rate_hardness_n_m);
  CHECK(b.depth_max_m < 0.5 * a.depth_max_m);
  CHECK(a.bounce_max_m > 1e-3);
  CHECK(b.bounce_max_m < 1e-3);
  CHECK(b.contacts == 1);
}
