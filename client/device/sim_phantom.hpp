// Device `sim`: a simulated Phantom 1.5 in a simulated hand.
//
//     (m_device + m_hand) x'' = F - b_device x' + k_hand (w - x) + b_hand (w' - x'),        w = intention + tremor
//
// x is the tool point, F the written force, w the intended position of the tool. The device adds its apparent mass (75 g), clamps
// the force to 8.5 N, renders it in steps of 0.07 N per axis (held until the next write) and reads its position in steps of 0.03
// mm per axis relative to where it was switched on. It has no gravity, and no friction unless b_device is given: the least damped
// case.
//
// Where the intention includes orientation, opening and buttons, so do the readings.
//
// With `wrist` it turns too, and renders a torque T about the tool point:
//
//     (J_device + J_hand) w' = T - c_device w - k_wrist y + c_wrist (w_0 - w),        y = log(R R_0^-1)
//
// R is how the tool is held, R_0 how the hand intends to (upright without orientations), w and w_0 their rates of rotation
// [rad/s]. The inertia is the same about every axis. Without it the tool is held as intended.
//
// The equation is linear; with F constant and w linear inside a sub-step of at most 0.25 ms its Taylor series to 16th order is
// exact to rounding, so only the stated quantisation and the sampling of w separate it from the closed form. Rotation is advanced
// in the same way, with y' for w - w_0: exact about an axis that stays, else up to the second order in y, which is some
// hundredths of a radian. The same seed and the same calls give the same bits.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <optional>

#include "client/device/hand.hpp"
#include "client/device/motion_device.hpp"
#include "common/motion/motion.hpp"

namespace palpate {

/// Rotation of a tool and of the hand that holds it.
struct SimWrist {
  // the hand: no measured preset; damping ratio 0.32 like that of the reference hand
  double inertia_kg_m2 = 2e-3, damping_nm_s_rad = 0.02, stiffness_nm_rad = 0.5;
  double device_inertia_kg_m2 = 1e-4, device_damping_nm_s_rad = 0;
  double torque_step_nm = 1e-3;  ///< 0 = not quantised
  double torque_max_nm = 0.3;    ///< Euclidean norm
};

struct SimPhantomOptions {
  Hand hand{0.5, 6, 135};
  double tremor_m = 1e-4;           ///< amplitude of the sine with the tremor's power, 0 = a steady hand
  std::uint64_t seed = 1;           ///< seed of the tremor
  double device_mass_kg = 0.075;    ///< apparent mass at the tool
  double device_damping_n_s_m = 0;  ///< b_device: viscous friction of the device itself
  double position_step_m = 3e-5;    ///< 0 = not quantised
  double force_step_n = 0.07;       ///< 0 = not quantised
  double force_max_n = 8.5;         ///< Euclidean norm
  double release_s = std::numeric_limits<double>::infinity();  ///< motion time at which the hand releases the device
  Hand hand_after_release = {};        ///< the grip from then on; all zero: none, otherwise the grip only loosens
  std::optional<SimWrist> wrist = {};  ///< a hand that lets go of the device leaves it to turn freely
};

class SimPhantom final : public MotionDevice {
 public:
  /// Throws InputError when a number is negative or not finite, or when the mass or a hand is beyond what a sub-step resolves.
  SimPhantom(Motion intention, const SimPhantomOptions& options);

  const DeviceCaps& caps() const override { return caps_; }
  /// Advances to `now`; always ok: after its motion the hand holds still. A `now` that goes back changes nothing. A gap of more
  /// than kGapMax is not made up for: the hand stood still for the rest of it.
  DeviceReading read(Micros now) noexcept override;
  void write(const Wrench& wrench) noexcept override;
  void stop() noexcept override { wrench_ = {}; }
  void halt() noexcept override { halted_.store(true, std::memory_order_release); }
  void resume() noexcept override { halted_.store(false, std::memory_order_release); }

  /// The state behind the quantised reading, for experiments and tests.
  const Vec3& position() const noexcept { return position_; }
  const Vec3& velocity() const noexcept { return velocity_; }
  const Rotation& turn() const noexcept { return turn_; }
  const Vec3& spin() const noexcept { return spin_; }  ///< w [rad/s]
  /// Force [N] and torque [N m] being rendered, clamped and quantised.
  const Vec3& force() const noexcept { return wrench_.force; }
  const Vec3& torque() const noexcept { return wrench_.torque; }

  // The vendor states no limit; a step from nothing to the peak force in about four ticks feels like a knock, not a blow.
  static constexpr double kSlewMaxNS = 2000;
  static constexpr double kTorqueSlewMaxNmS = 75;  ///< in four ticks as well
  // Limits for the reader, not of the simulation, which has neither motors that warm nor arms that end: faster than people move a
  // tool, and as far as an arm reaches, each way from where it was switched on.
  static constexpr double kSpeedMaxMS = 5, kReachM = 0.5, kSpinMaxRadS = 30;
  static constexpr Micros kSubStepMax{250};
  static constexpr Micros kGapMax{100'000};

 private:
  Vec3 wanted(Micros t) const noexcept;
  Rotation wanted_turn(Micros t) const noexcept;
  void step(Micros from, Micros to) noexcept;
  void turn_step(Micros from, Micros to, const Vec3& torque) noexcept;

  Motion intention_;
  SimPhantomOptions options_;
  DeviceCaps caps_;
  Tremor tremor_;
  std::atomic<bool> halted_{false};
  Vec3 origin_, position_, velocity_ = Vec3::Zero();
  Rotation turn_ = Rotation::Identity();
  Vec3 spin_ = Vec3::Zero();
  Wrench wrench_;
  Micros release_ = Micros::max();  ///< motion time
  Micros time_{};                   ///< motion time of the state
  Micros lost_{};                   ///< sum of the gaps that were not made up for
};

}  // namespace palpate
