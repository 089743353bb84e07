// Thermal limit of a device's motors: a peak force for a moment, the continuous force indefinitely. For
// the motors that turn the tool: torque [N m] instead of force.
//
// Copper loss grows with the square of the current, and so of the force F. With F_c the continuous force and T a time constant,
// the temperature rise, as a share of the allowed rise of the windings, follows
//
//     T heat' = (F / F_c)^2 - heat,          heat(0) = 0,     exact over a tick in which F is held
//
// and the allowed force goes from the peak F_p to F_c as the rise approaches its limit:
//
//     F_most^2 = F_c^2 + (F_p^2 - F_c^2) min(1, (1 - heat) / kBand)          at least F_c^2
//
// so heat <= 1 always, and no edge is felt. It is the I^2 t limiter of servo drives; the model is the one thermal body of IEC
// 60034-11's motor protection.
//
// Vendors state F_p and F_c but no time. Small ironless motors, as in these devices, are two bodies: windings that follow within
// 12 s and carry a fifth of the rise, and a housing that needs ten minutes (catalogue of a 25 mm motor, from memory: 3.1 and 14
// K/W, 12 and 612 s). From cold those withstand 37 times their rated loss (8.5 N where 1.4 N is continuous) for 1.8 s, 13 times
// for 6.1 s and 4.6 times for 36 s. One body with T = 60 s allows 1.7, 4.9 and 15 s: never more. A device with a better model
// limits itself.
#pragma once

namespace palpate {

class MotorHeat {
 public:
  static constexpr double kTimeS = 60;
  static constexpr double kBand = 0.2;

  /// With `continuous_n` = 0, or not below `peak_n`, `peak_n` is allowed indefinitely.
  MotorHeat(double peak_n, double continuous_n) : peak_n_(peak_n), continuous_n_(continuous_n) {}
  /// Notes that the motors held `force_n` for `dt_s` >= 0; both finite.
  void hold(double force_n, double dt_s) noexcept;
  /// Returns the allowed force F_most [N].
  double most_n() const noexcept;
  /// Temperature rise relative to the allowed rise.
  double heat() const noexcept { return heat_; }

 private:
  bool limits() const noexcept { return continuous_n_ > 0 && continuous_n_ < peak_n_; }

  double peak_n_, continuous_n_, heat_ = 0;
};

}  // namespace palpate
