// Passivity observer and controller at the tool: time domain, after Hannaford and Ryu (2002), with an allowance that cannot be
// overdrawn as in the energy tanks of Franken et al. (IEEE Trans. Robotics 27, 2011). The error of a delayed patch is unknown
// here, so nothing is assumed about it.
//
// The observer counts the energy E that the hand has put into the display and that the display has not returned yet:
//
//     E += -1/2 (F_before + F_now) . dx                 per tick, dx the tool's motion in the tick
//
// Of a tool that feels torque the account is that of both: - 1/2 (T_before + T_now) . dphi is added, dphi its rotation in the
// tick. One account, because one contact may return through the torque what it was given through the force; two would damp that.
// F and T / L make one vector, dx and L dphi another, so that F . dx + T . dphi is their product, and everything below holds for
// them as it does for F and dx: the bounds on the energy are those of force and torque together. L = kLeverM only weighs one
// against the other in |F|, in the displacement below and in the damper, whose inertia m L^2 about the tool point has to be no
// more than a handle's. Without torque nothing depends on it.
//
// F is the force on the tool as finally rendered, with the controller's own contribution and all limits. It is not known yet
// while a tick is computed: the requested force and the damper of the previous tick stand in for it, and rendered() corrects
// that. A display of springs, masses and dampers that starts unloaded keeps E >= 0. The mean of both ends makes a spring sampled
// at 1 kHz count as lossless; the leak of holding its force for a tick (k |dx|^2 / 2) is left to the device's friction, because
// otherwise every spring would be damped. Over skipped ticks the device held F_before, and that alone counts.
//
// The controller answers a deficit D = -E - kToleranceJ > 0 by F_damper, which has three parts. With f = F / |F|, F now the
// requested force, v_f = v . f and v_t = v - v_f f:
//
//     weaker     -w F                         w = (E_a - E - kFullJ) / (kMostJ - kFullJ) within [0, 1]
//     along      -clamp(alpha v_f, -s |F|, s (1 - w) |F|) f          s = min(1, D / (kFullJ - E_h))
//     across     -s beta v_t                  beta = min(alpha, P / |v_t|^2), where P > 0
//
// E_a = max(0, 2 ms F . dx / dt - kFullJ) is the energy that a fast tool receives before the current force has been judged: 8.5 N
// at 0.5 m/s are 4 mJ in a tick. E_h = |F| v_f 1 ms within [0, kFullJ / 4] compensates for s being half a tick late. P = ((1 - w)
// |F| - alpha v_f) v_f is the power still given after the first two parts.
//
// Along: a damper that weakens a force which pushes the hand along and strengthens one that resists, never by more than the force
// itself, so that it comes and goes with the deficit and vanishes with the force. Across: a tool that orbits meets most of its
// force at right angles to its path, so that v_f is small, a damper along f stops little, and the orbit grows; drag along v_t
// removes just the energy given there. A tool that slides under a force that gives no energy feels none of this drag. Weaker: a
// motion that no damper can stop, because it is slower than F / alpha, ends by itself: the power falls with the remaining
// allowance, and E stays above -kMostJ but for the energy of one tick. E regains kReturnW up to -kFullJ, because otherwise a
// force would never be complete again: giving way to F costs a display F^2 / 2 k at a hand of stiffness k. So the hand gets
// kMostJ at once and kReturnW from then on, and no more, whatever the patch: also where a force returns to a tool that entered
// the body while it felt nothing, and where another hand pushes this one through the body. A hand that stands still feels the
// whole force again after (kMostJ - kFullJ) / kReturnW = 1.4 s.
//
// v is the displacement over the last time T, divided by T: the shortest time in which the tool moved by kWayM, with a part of a
// tick counted as a part, at most kWindow ticks. A device reads its position in steps (0.03 mm for a Phantom), and a step in one
// tick looks like a speed of 0.03 m/s that was not there; a busy machine reads it early or late. The estimate is T / 2 late, so
// alpha = m / (T + dt), m = kDeviceKg: a quarter of the value that makes that much mass overshoot. A relative error e of
// displacement and time changes along and across by 2 e; so these move half of the way to the values above in each tick, unless
// they would push the tool along or exceed |F|. A Phantom's step changes F_damper by 8 %, and in a slow motion by alpha step / 2
// T = 0.02 N; a tick that is read 0.3 ms late, at 0.1 m/s, by 9 %.
//
// Rest: after kRestTicks without force the display stores nothing that it could return, and E starts again from 0. E is bounded
// by kEnergyMaxJ both ways, so that a long stroke does not pay for later instability.
#pragma once

#include <array>

#include "common/base/wrench.hpp"

namespace palpate {

class Passivity {
 public:
  /// Runs the observer. `wrench` and `moved` are finite; the tick lasted `dt_s` > 0.
  void observe(const Wrench& wrench, const SmallMotion& moved, double dt_s) noexcept;
  /// Runs the controller: returns the wrench to add to `wrench`, the one observed last; zero while E is in order. Once a tick.
  Wrench damper(const Wrench& wrench) noexcept;
  /// Reports the wrench finally rendered, and the damper's part of it.
  void rendered(const Wrench& wrench, const Wrench& damper) noexcept;
  void reset() noexcept;
  /// E [J].
  double energy_j() const noexcept { return energy_j_; }
  /// Energy that the damper took out of the hand's motion so far [J]; a reset does not change it.
  double dissipated_j() const noexcept { return dissipated_j_; }

  static constexpr double kToleranceJ = 1e-5;  ///< 0.01 N over 1 mm
  static constexpr double kFullJ = 1e-3;       ///< 0.1 N over 10 mm: hardly what a hand feels
  static constexpr double kAlphaMaxNSM = 20;
  static constexpr double kDeviceKg = 0.075;  ///< apparent mass of a Phantom 1.5 that nobody holds
  static constexpr double kLeverM = 0.02;     ///< L: 3e-5 kg m^2 with kDeviceKg
  static constexpr double kWayM = 4e-4;
  static constexpr std::size_t kWindow = 8;
  static constexpr double kEnergyMaxJ = 0.2;  ///< 8.5 N reached over 47 mm
  static constexpr int kRestTicks = 50;
  static constexpr double kMostJ = 8e-3;
  static constexpr double kReturnW = 5e-3;  ///< 1 N that moves at 5 mm/s

 private:
  /// (F, T / L) or (dx, L dphi).
  struct Six {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    static Six of(const Wrench& w) { return {w.force, w.torque / kLeverM}; }
    static Six of(const SmallMotion& m) { return {m.way, kLeverM * m.angle}; }
    Wrench wrench() const { return {linear, kLeverM * angular}; }
    double dot(const Six& o) const { return linear.dot(o.linear) + angular.dot(o.angular); }
    double square() const { return dot(*this); }
    double norm() const;
    double stable_norm() const;
    friend Six operator+(const Six& a, const Six& b) { return {a.linear + b.linear, a.angular + b.angular}; }
    friend Six operator-(const Six& a, const Six& b) { return {a.linear - b.linear, a.angular - b.angular}; }
    friend Six operator/(const Six& a, double s) { return {a.linear / s, a.angular / s}; }
    friend Six operator*(double s, const Six& a) { return {s * a.linear, s * a.angular}; }
  };
  struct Motion {
    Six velocity;
    double alpha;
  };
  static double share_to(double length, const Six& way, const Six& step) noexcept;
  Motion motion() const noexcept;
  Six damped(const Six& force) noexcept;
  Six drag(const Six& force, double force_n) const noexcept;
  double weakened() const noexcept;
  void gain(double energy_j) noexcept;

  struct Step {
    Six dx;
    double dt_s = 0;
  };
  std::array<Step, kWindow> steps_{};
  std::size_t newest_ = 0;
  Six force_, damper_, drag_;
  Six expected_, half_way_;  ///< half_way_: displacement weighted with the force of this tick
  double energy_j_ = 0, dissipated_j_ = 0;
  int rest_ticks_ = 0;
};

}  // namespace palpate
