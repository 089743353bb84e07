#include "client/device/sim_phantom.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/error.hpp"
#include "common/base/rotation_vector.hpp"

namespace palpate {

namespace {

constexpr int kTaylorOrder = 16;
// Chosen so that a sub-step advances the fastest motion by well under a radian, where the series converges to rounding.
constexpr double kStiffnessMaxNM = 1e5, kDampingMaxNSM = 100, kMassMinKg = 0.02;
constexpr double kInertiaMinKgM2 = 3e-5, kWristDampingMax = 0.15, kWristStiffnessMax = 150;  // the same ratios
// A Phantom 1.5 starts to buzz beyond this when a wall is rendered at 1 kHz; its mechanical stiffness is 3500 N/m.
constexpr double kRenderedStiffnessMaxNM = 800;

void check(bool holds, const char* field, const char* expected) {
  if (!holds) throw InputError("simulated device", std::string(field) + " is out of range", expected);
}

void check(const SimPhantomOptions& o) {
  const auto between = [](double value, double low, double high) { return value >= low && value <= high; };
  for (const Hand& hand : {o.hand, o.hand_after_release}) {
    check(between(hand.mass_kg, 0, 100), "hand mass", "0 to 100 kg");
    check(between(hand.damping_n_s_m, 0, kDampingMaxNSM), "hand damping", "0 to 100 N s/m");
    check(between(hand.stiffness_n_m, 0, kStiffnessMaxNM), "hand stiffness", "0 to 100000 N/m");
  }
  check(between(o.device_mass_kg, kMassMinKg, 100), "device mass", "0.02 to 100 kg");
  check(between(o.device_damping_n_s_m, 0, kDampingMaxNSM), "device damping", "0 to 100 N s/m");
  check(between(o.tremor_m, 0, 0.01), "tremor", "0 to 0.01 m");
  check(between(o.position_step_m, 0, 0.01), "position step", "0 to 0.01 m");
  check(between(o.force_step_n, 0, 10), "force step", "0 to 10 N");
  check(between(o.force_max_n, 0, 1000), "force limit", "0 to 1000 N");
  check(o.release_s >= 0, "release time", "0 s or later");
  if (!o.wrist) return;
  check(between(o.wrist->device_inertia_kg_m2, kInertiaMinKgM2, 1), "device inertia", "0.00003 to 1 kg m^2");
  check(between(o.wrist->inertia_kg_m2, 0, 1), "wrist inertia", "0 to 1 kg m^2");
  check(between(o.wrist->damping_nm_s_rad, 0, kWristDampingMax), "wrist damping", "0 to 0.15 N m s/rad");
  check(between(o.wrist->device_damping_nm_s_rad, 0, kWristDampingMax), "device damping", "0 to 0.15 N m s/rad");
  check(between(o.wrist->stiffness_nm_rad, 0, kWristStiffnessMax), "wrist stiffness", "0 to 150 N m/rad");
  check(between(o.wrist->torque_step_nm, 0, 1), "torque step", "0 to 1 N m");
  check(between(o.wrist->torque_max_nm, 0, 100), "torque limit", "0 to 100 N m");
}

/// y'' = source - k y - b y' with a constant source.
struct Oscillator {
  Vec3 y, rate;
  void advance(double h, double k, double b, Vec3 source) noexcept {
    Vec3 low = y, high = rate;  // n-th and (n+1)-th derivatives
    rate = Vec3::Zero();
    double power = 1;  // h^n / n!
    for (int n = 0; n < kTaylorOrder; ++n) {
      rate += power * high;
      power *= h / (n + 1);
      y += power * high;
      const Vec3 next = source - k * low - b * high;
      low = high;
      high = next;
      source = Vec3::Zero();
    }
  }
};

Vec3 quantised(const Vec3& value, double step) { return step > 0 ? Vec3((value / step).array().round() * step) : value; }

}  // namespace

SimPhantom::SimPhantom(Motion intention, const SimPhantomOptions& options)
    : intention_(std::move(intention)), options_(options), tremor_(options.tremor_m, options.seed) {
  check(options_);
  origin_ = position_ = intention_.position(0.0);
  if (options_.release_s < kMaxMotionS) release_ = from_seconds(options_.release_s);
  caps_ = {options_.wrist ? "sim6" : "sim", options_.force_max_n, kSlewMaxNS, kRenderedStiffnessMaxNM};
  caps_.force_continuous_n = options_.force_max_n;  // simulated motors stay cold
  caps_.velocity_max_m_s = kSpeedMaxMS;
  caps_.has_orientation = intention_.has_orientation();
  caps_.buttons = intention_.button_count();
  caps_.has_opening = intention_.has_opening();
  turn_ = wanted_turn({});
  if (options_.wrist) {
    caps_.has_orientation = caps_.renders_torque = true;
    caps_.torque_max_nm = caps_.torque_continuous_nm = options_.wrist->torque_max_nm;
    caps_.torque_slew_max_nm_s = kTorqueSlewMaxNmS;
    caps_.spin_max_rad_s = kSpinMaxRadS;
  }
  caps_.workspace = Eigen::AlignedBox3d(origin_ - Vec3::Constant(kReachM), origin_ + Vec3::Constant(kReachM));
}

DeviceReading SimPhantom::read(Micros now) noexcept {
  const Micros elapsed = clock_.elapsed(now);
  if (elapsed - lost_ - time_ > kGapMax) lost_ = elapsed - time_ - kGapMax;
  while (time_ < elapsed - lost_) {
    const Micros next = std::min(time_ + kSubStepMax, elapsed - lost_);
    step(time_, next);
    time_ = next;
  }
  DeviceReading reading{origin_ + quantised(position_ - origin_, options_.position_step_m), DeviceState::ok,
                        Eigen::Quaterniond(options_.wrist ? turn_ : wanted_turn(time_)), intention_.buttons(time_)};
  reading.opening = intention_.opening(time_);
  return reading;
}

void SimPhantom::write(const Wrench& wrench) noexcept {
  const SimWrist wrist = options_.wrist.value_or(SimWrist{.torque_step_nm = 0, .torque_max_nm = 0});
  Wrench asked = finite_parts(wrench);
  if (wrist.torque_max_nm <= 0) asked.torque.setZero();
  if (options_.force_max_n <= 0) asked.force.setZero();
  const Wrench shown = limited_to(asked, options_.force_max_n, wrist.torque_max_nm);
  wrench_ = {quantised(shown.force, options_.force_step_n), quantised(shown.torque, wrist.torque_step_nm)};
}

Vec3 SimPhantom::wanted(Micros t) const noexcept { return intention_.position(t) + tremor_.offset(seconds(t)); }

Rotation SimPhantom::wanted_turn(Micros t) const noexcept {
  return Rotation(intention_.orientation(t).value_or(Eigen::Quaterniond::Identity()));
}

void SimPhantom::step(Micros from, Micros to) noexcept {
  const double h = seconds(to - from);
  const Hand& hand = from < release_ ? options_.hand : options_.hand_after_release;
  const double mass = options_.device_mass_kg + hand.mass_kg;
  const double k = hand.stiffness_n_m / mass, b = (hand.damping_n_s_m + options_.device_damping_n_s_m) / mass;
  const Vec3 begin = wanted(from), drift = (wanted(to) - begin) / h;

  // Relative to the wanted position, y = x - w: y'' = (F - b_device w')/m - k y - b y'.
  Oscillator relative{position_ - begin, velocity_ - drift};
  const Wrench rendered = halted_.load(std::memory_order_acquire) ? Wrench() : wrench_;
  relative.advance(h, k, b, (rendered.force - options_.device_damping_n_s_m * drift) / mass);
  position_ = begin + h * drift + relative.y;
  velocity_ = drift + relative.rate;
  if (options_.wrist) turn_step(from, to, rendered.torque);
}

void SimPhantom::turn_step(Micros from, Micros to, const Vec3& torque) noexcept {
  const double h = seconds(to - from);
  SimWrist wrist = *options_.wrist;
  if (from >= release_ && !options_.hand_after_release.holds())
    wrist.inertia_kg_m2 = wrist.damping_nm_s_rad = wrist.stiffness_nm_rad = 0;
  const double inertia = wrist.device_inertia_kg_m2 + wrist.inertia_kg_m2;
  const Rotation begin = wanted_turn(from), end = wanted_turn(to);
  const Vec3 drift = rotation_between(begin, end) / h;
  Oscillator relative{rotation_between(begin, turn_), spin_ - drift};
  relative.advance(h, wrist.stiffness_nm_rad / inertia, (wrist.damping_nm_s_rad + wrist.device_damping_nm_s_rad) / inertia,
                   (torque - wrist.device_damping_nm_s_rad * drift) / inertia);
  turn_ = (rotation_by(relative.y) * end).normalized();
  spin_ = drift + relative.rate;
}

}  // namespace palpate
