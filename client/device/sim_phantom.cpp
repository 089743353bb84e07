#include "client/device/sim_phantom.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr int kTaylorOrder = 16;
// Chosen so that a sub-step advances the fastest motion by well under a radian, where the series converges to rounding.
constexpr double kStiffnessMaxNM = 1e5, kDampingMaxNSM = 100, kMassMinKg = 0.02;
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
}

Vec3 quantised(const Vec3& value, double step) { return step > 0 ? Vec3((value / step).array().round() * step) : value; }

}  // namespace

SimPhantom::SimPhantom(Motion intention, const SimPhantomOptions& options)
    : intention_(std::move(intention)), options_(options), tremor_(options.tremor_m, options.seed) {
  check(options_);
  origin_ = position_ = intention_.position(0.0);
  if (options_.release_s < kMaxMotionS) release_ = from_seconds(options_.release_s);
  caps_ = {"sim", options_.force_max_n, kSlewMaxNS, kRenderedStiffnessMaxNM};
  caps_.force_continuous_n = options_.force_max_n;  // simulated motors stay cold
  caps_.velocity_max_m_s = kSpeedMaxMS;
  caps_.has_orientation = intention_.has_orientation();
  caps_.buttons = intention_.button_count();
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
  return {origin_ + quantised(position_ - origin_, options_.position_step_m), DeviceState::ok,
          intention_.orientation(time_).value_or(Eigen::Quaterniond::Identity()), intention_.buttons(time_)};
}

void SimPhantom::write(const Vec3& force) noexcept {
  if (!force.allFinite()) {
    force_ = Vec3::Zero();
    return;
  }
  const double norm = force.stableNorm();
  const double scale = norm > options_.force_max_n ? options_.force_max_n / norm : 1.0;
  force_ = quantised(scale * force, options_.force_step_n);
}

Vec3 SimPhantom::wanted(Micros t) const noexcept { return intention_.position(t) + tremor_.offset(seconds(t)); }

void SimPhantom::step(Micros from, Micros to) noexcept {
  const double h = seconds(to - from);
  const Hand& hand = from < release_ ? options_.hand : options_.hand_after_release;
  const double mass = options_.device_mass_kg + hand.mass_kg;
  const double k = hand.stiffness_n_m / mass, b = (hand.damping_n_s_m + options_.device_damping_n_s_m) / mass;
  const Vec3 begin = wanted(from), drift = (wanted(to) - begin) / h;

  // Relative to the wanted position, y = x - w: y'' = (F - b_device w')/m - k y - b y'. `low`, `high` are its n-th and (n+1)-th
  // derivatives.
  Vec3 low = position_ - begin, high = velocity_ - drift;
  Vec3 y = low, rate = Vec3::Zero();
  double power = 1;  // h^n / n!
  const Vec3 rendered = halted_.load(std::memory_order_acquire) ? Vec3::Zero() : force_;
  Vec3 source = (rendered - options_.device_damping_n_s_m * drift) / mass;
  for (int n = 0; n < kTaylorOrder; ++n) {
    rate += power * high;
    power *= h / (n + 1);
    y += power * high;
    const Vec3 next = source - k * low - b * high;
    low = high;
    high = next;
    source = Vec3::Zero();
  }
  position_ = begin + h * drift + y;
  velocity_ = drift + rate;
}

}  // namespace palpate
