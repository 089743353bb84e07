// Passivity observer and controller at the tool (time domain; Hannaford and Ryu, 2002).
//
// The observer counts the energy E that the hand has put into the display and that the display has not given back yet:
//
//     E += -1/2 (F_before + F_now) . dx  -  F_damper . dx        per tick, dx the tool's motion in the tick
//
// F is the force on the tool without the controller's own, F_damper what the controller added. A display of springs, masses
// and dampers that starts unloaded keeps E >= 0. The mean of both ends makes a spring sampled at 1 kHz count as lossless; what
// holding its force for a tick leaks (k |dx|^2 / 2) is left to the device's friction, or else every spring would be damped.
//
// The controller answers E < -kToleranceJ with a damper -alpha v that takes the deficit back within one tick at the present
// speed, alpha <= kAlphaMaxNSM. Resting: after kRestTicks without force the display stores nothing that it could return, and E
// starts again from 0. E is bounded by kEnergyMaxJ both ways, so that a long stroke does not pay for later instability.
#pragma once

#include "common/base/types.hpp"

namespace palpate {

class Passivity {
 public:
  /// Observer. `force` and `dx` are finite. Returns E [J].
  double observe(const Vec3& force, const Vec3& dx) noexcept;
  /// Controller: the damper's force for a tool that moved by `dx` in the last `dt_s` > 0; zero while E is in order.
  Vec3 damper(const Vec3& dx, double dt_s) const noexcept;
  /// What was rendered in the end: the display's own force and the damper's.
  void rendered(const Vec3& force, const Vec3& damper) noexcept;
  void reset() noexcept;
  /// What the damper took out of the hand's motion so far [J]; a reset does not change it.
  double dissipated_j() const noexcept { return dissipated_j_; }

  static constexpr double kToleranceJ = 1e-5;  ///< 0.01 N over 1 mm: below what a hand feels
  static constexpr double kAlphaMaxNSM = 20;   ///< a 75 g device stays stable up to m / dt = 75 N s/m
  static constexpr double kEnergyMaxJ = 0.2;   ///< 8.5 N reached over 47 mm
  static constexpr int kRestTicks = 50;

 private:
  Vec3 force_ = Vec3::Zero(), damper_ = Vec3::Zero();
  double energy_j_ = 0, dissipated_j_ = 0;
  int rest_ticks_ = 0;
};

}  // namespace palpate
