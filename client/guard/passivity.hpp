// Passivity observer and controller at the tool (time domain; after Hannaford and Ryu, 2002).
//
// The observer counts the energy E that the hand has put into the display and that the display has not given back yet:
//
//     E += -1/2 (F_before + F_now) . dx  -  F_damper . dx        per tick, dx the tool's motion in the tick
//
// F is the force on the tool without the controller's own, F_damper what the controller added. A display of springs, masses
// and dampers that starts unloaded keeps E >= 0. The mean of both ends makes a spring sampled at 1 kHz count as lossless; what
// holding its force for a tick leaks (k |dx|^2 / 2) is left to the device's friction, or else every spring would be damped.
// Over ticks that were skipped the device held F_before, and that alone counts.
//
// The controller answers a deficit D = -E - kToleranceJ > 0 with a damper along the force, f = F / |F|:
//
//     F_damper = -clamp(alpha v . f, +-s |F|) f,      s = min(1, D / kFullJ)
//
// It weakens a force that pushes the hand along and strengthens one that resists, never by more than the force itself, so that
// it comes and goes with the deficit, adds no drag across the force, and dies with the force. Where alpha |v . f| >= |F| it can
// stop whatever the display gives, and D stays at kFullJ; a slower motion than that takes (|F| - alpha v) along its way.
//
// v is the way of the last n ticks over their time: n the least that covers kWayM, at most kWindow, because a device reads its
// position in steps (0.03 mm for a Phantom), and a step in one tick is a speed of 0.03 m/s that was not there. The estimate is
// (n + 1) / 2 ticks late, so alpha = m / ((n + 1) dt), m = kDeviceKg: a quarter of what makes that much mass overshoot. One step
// moves F_damper by at most alpha step / (n dt): 0.03 N in a slow motion, 8 % of F_damper in one that covers kWayM.
//
// A force that comes back, or comes for the first time, has nothing stored that it could give: the tool of a station that was cut
// off may have gone into the body for nothing. For kReturnTicks from there, and on until the deficit is below kFullJ, the
// whole force is weakened as well, to
//
//     F (1 - w),      w = (-E - kFullJ) / (kReturnFullJ - kFullJ) within [0, 1],
//
// and E regains kReturnW up to -kFullJ: the hand gets kReturnFullJ at once and kReturnW from then on, and no more; one that
// stands still feels the whole force again after (kReturnFullJ - kFullJ) / kReturnW. Not later: what another hand does to
// this one through the body is energy that this hand did not put in, and it shall feel that.
//
// Resting: after kRestTicks without force the display stores nothing that it could return, and E starts again from 0. E is
// bounded by kEnergyMaxJ both ways, so that a long stroke does not pay for later instability.
#pragma once

#include <array>

#include "common/base/types.hpp"

namespace palpate {

class Passivity {
 public:
  /// Observer. `force` and `dx` are finite; the tick took `dt_s` > 0. Returns E [J].
  double observe(const Vec3& force, const Vec3& dx, double dt_s) noexcept;
  /// Controller: what to add to `force`, the one that was observed last; zero while E is in order. Once a tick.
  Vec3 damper(const Vec3& force) noexcept;
  /// What was rendered in the end: the display's own force and the damper's.
  void rendered(const Vec3& force, const Vec3& damper) noexcept;
  void reset() noexcept;
  /// What the damper took out of the hand's motion so far [J]; a reset does not change it.
  double dissipated_j() const noexcept { return dissipated_j_; }

  static constexpr double kToleranceJ = 1e-5;  ///< 0.01 N over 1 mm
  static constexpr double kFullJ = 1e-3;       ///< 0.1 N over 10 mm: hardly what a hand feels
  static constexpr double kAlphaMaxNSM = 20;
  static constexpr double kDeviceKg = 0.075;  ///< apparent mass of a Phantom 1.5 that nobody holds
  static constexpr double kWayM = 4e-4;
  static constexpr std::size_t kWindow = 8;
  static constexpr double kEnergyMaxJ = 0.2;  ///< 8.5 N reached over 47 mm
  static constexpr int kRestTicks = 50;
  static constexpr double kReturnFullJ = 8e-3;
  static constexpr double kReturnW = 5e-3;  ///< 1 N that moves at 5 mm/s
  static constexpr int kReturnTicks = 1000;

 private:
  Vec3 damped(const Vec3& force) const noexcept;
  double weakened() const noexcept;

  struct Step {
    Vec3 dx = Vec3::Zero();
    double dt_s = 0;
  };
  std::array<Step, kWindow> steps_{};
  std::size_t newest_ = 0;
  Vec3 force_ = Vec3::Zero(), damper_ = Vec3::Zero();
  double energy_j_ = 0, dissipated_j_ = 0;
  int rest_ticks_ = 0, return_ticks_ = 0;
  bool returns_ = true;
};

}  // namespace palpate
