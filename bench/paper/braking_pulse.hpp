// A device hits a stiff wall with limited force and stiffness, sampled once per period, with and without a braking pulse.
//
//     wall          F = -K x - B x'   for x > 0, never pulling;  x' is the last period's motion over T
//     pulse         at the first sample inside, with the speed v of the last period, the device has the momentum m v; it is
//                   removed in N = ceil( m v / (T F_max) ) periods of force -m v / (N T) each, in addition to the wall's force
//
// x position behind the surface [m], m the device's mass. A pulse needs no stiffness, so it brakes at speeds and on walls at
// which K is limited by the sampling (sampled_wall.hpp). The total is clamped to F_max. The device starts in front of the
// surface, at a distance that it covers in one and a half periods, with the speed v, and is pushed on by the hand's constant
// force.
// Source: Salcudean and Vlaar, ASME J. Dynamic Systems, Measurement, and Control 119 (1997).
//
// Perceived hardness is measured by the rate-hardness (Lawrence, Pao, Dougherty, Salada and Pavlou, IEEE Trans. Robotics and
// Automation 16 (2000)), the initial rate of change of force over the initial speed of penetration [N/m]: for a sampled wall the
// largest rise of force in a window after the first sample inside, over window and speed.
#pragma once

#include <vector>

#include "bench/paper/sampled_wall.hpp"

namespace palpate {

struct Impact {
  Device1d device{0.075, 0.5, 0};
  double wall_n_m = 1500, wall_n_s_m = 0;  ///< K, B
  double speed_m_s = 0.2;
  double push_n = 0.5;       ///< force of the hand
  double force_max_n = 8.5;  ///< limit of the device
  double period_s = 1e-3;
  double duration_s = 0.5;
  bool pulse = false;
};

struct ImpactResult {
  std::vector<double> position_m, force_n;  ///< at every sample, from index 0 on; the force displayed from then on
  double depth_max_m = 0;
  double bounce_max_m = 0;  ///< largest distance in front of the surface after the first contact
  int contacts = 0;         ///< number of times that the surface was entered
  double rest_ms = 0;       ///< time from contact until it stays within 0.1 mm of the equilibrium with the push
  double rate_hardness_n_m = 0;
  int pulse_periods = 0;
  double pulse_impulse_n_s = 0;  ///< momentum removed by the pulse alone
};

inline constexpr double kRateWindowS = 2e-3;

ImpactResult hit(const Impact& impact);

}  // namespace palpate
