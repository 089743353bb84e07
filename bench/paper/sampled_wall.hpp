// A haptic device on a sampled virtual wall: when does it oscillate by itself?
//
//     m x'' + b x' + k_o x = F(t),   F held over each period T
//     without a coupling:  F_n = -K x_n - B (x_n - x_n-1) / T
//     with one:            F_n from virtual_coupling.hpp, whose virtual tool stands on the wall K
//
// m, b: device (including what the hand adds); k_o: the operator's spring; K, B: the wall. The wall pulls as well as pushes: the
// linear case, for which stability is a spectral radius. Between samples the device moves by the exact exponential. The loop is
// one linear map of (x, x', x_n-1) or of (x, x', virtual tool) from period to period, stable if and only if all its eigenvalues
// lie inside the unit circle. It is passive, and so stable with every passive operator, if and only if  b > K T / 2 + |B|
// (Colgate and Schenkel, J. Robotic Systems 14 (1997)).
#pragma once

#include <optional>

#include "client/guard/virtual_coupling.hpp"
#include "server/body/block_matrix.hpp"

namespace palpate {

struct Device1d {
  double mass_kg = 0.075, damping_n_s_m = 0.5;
  double operator_n_m = 0;  ///< k_o
};

/// Exact step over one period under a constant force: position [m], velocity [m/s].
class DeviceStep {
 public:
  DeviceStep(const Device1d& device, double period_s);
  void advance(double force_n, double& position_m, double& velocity_m_s) const {
    const double x = position_m;
    position_m = phi_(0, 0) * x + phi_(0, 1) * velocity_m_s + psi_[0] * force_n;
    velocity_m_s = phi_(1, 0) * x + phi_(1, 1) * velocity_m_s + psi_[1] * force_n;
  }

 private:
  Eigen::Matrix2d phi_;
  Eigen::Vector2d psi_;
};

struct WallLoop {
  Device1d device;
  double stiffness_n_m = 0, damping_n_s_m = 0;  ///< K, B; B only without a coupling
  double period_s = 1e-3;                       ///< T
  std::optional<CouplingParameters> coupling;
};

/// Map from one period to the next.
Matrix loop_matrix(const WallLoop& loop);
/// Largest absolute eigenvalue of the map; below 1 the loop comes to rest.
double spectral_radius(const WallLoop& loop);

/// Positions at the end of every period [m] of the loop released 1 mm off; ends early if the motion has grown a millionfold.
std::vector<double> release_from_1mm(const WallLoop& loop, std::size_t periods);
/// Returns true if that motion comes to rest: its second half is smaller than its first.
bool settles(const WallLoop& loop, std::size_t periods);

/// Stiffest wall K [N/m] for which `stable(loop)` holds, by bisection to 1e-4 from 0 to `most`; 0 if there is none.
template <class Stable>
double stiffest(WallLoop loop, double most, const Stable& stable) {
  double low = 0, high = most;
  loop.stiffness_n_m = most;
  if (stable(loop)) return most;
  while (high - low > 1e-4 * high && high > 1e-3) {
    loop.stiffness_n_m = (low + high) / 2;
    (stable(loop) ? low : high) = loop.stiffness_n_m;
  }
  return low;
}

/// Smallest such K over operators that are lossless springs, with which the held device resonates at up to the sampling
/// frequency. The worst resonates at half of it, where the held force is a square wave with 8 / pi^2 of its power at that
/// frequency, so that K becomes  2 (pi^2/8 b - B) / T,  or the free device's 2 (b + B) / T if that is less. To reach the
/// passivity condition, an operator would have to resonate at every odd multiple.
double stiffest_for_any_spring(const WallLoop& loop, double most, int operators);

/// K of the passivity condition, 2 (b - B) / T, 0 if there is none [N/m].
inline double passive_wall_n_m(const WallLoop& loop) {
  return passive_stiffness_n_m(loop.device.damping_n_s_m, loop.damping_n_s_m, loop.period_s);
}

}  // namespace palpate
