// The verdict on loops whose boundary of stability has a closed form: a simulated device and hand on a delayed or sampled wall.
#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <functional>

#include "bench/measure/stability.hpp"
#include "common/base/rotation_vector.hpp"

using namespace palpate;

namespace {

constexpr double kTickS = 1e-3;

/// Force along z from the tool's z at this tick and earlier ones, the newest last.
using Law = std::function<double(double t_s, const std::deque<double>& z)>;

ClosedLoopResult loop_on(const Law& law, const Motion& intention, const SimPhantomOptions& options, double duration_s) {
  ClosedLoopResult result;
  SimPhantom device(intention, options);
  std::deque<double> past;
  for (int n = 0; n * kTickS <= duration_s && !result.lost; ++n) {
    device.read(Micros{1000 * n});
    past.push_back(device.position().z());
    if (past.size() > 500) past.pop_front();
    device.write(Vec3(0, 0, law(n * kTickS, past)));
    LoopTick tick;
    tick.position = device.position();
    tick.velocity = device.velocity();
    tick.force = device.force();
    tick.kinetic_j = 0.5 * options.device_mass_kg * tick.velocity.squaredNorm();
    result.ticks.push_back(tick);
    result.lost = tick.position.norm() > kLostM;
  }
  return result;
}

Law wall(double stiffness_n_m, int delay_ticks) {
  return [=](double, const std::deque<double>& z) {
    const auto n = static_cast<int>(z.size());
    return n > delay_ticks ? -stiffness_n_m * z[static_cast<std::size_t>(n - 1 - delay_ticks)] : 0.0;
  };
}

SimPhantomOptions held_by(const Hand& hand) {
  SimPhantomOptions options;
  options.hand = hand;
  options.tremor_m = options.position_step_m = options.force_step_n = 0;
  return options;
}

/// 4 mm in within 0.2 s, then still; rest is judged from kRestTick on.
const Motion kPush({{0.0, Vec3::Zero()}, {0.2, Vec3(0, 0, -0.004)}});
constexpr std::size_t kRestTick = 300;

/// First K for which (M s^2 + b s + k + K e^(-tau s)) x has a root on the imaginary axis: K sin(w tau) = b w, K cos(w tau) = M
/// w^2 - k.
double boundary_n_m(double mass_kg, const Hand& hand, double delay_s) {
  const auto imaginary = [&](double w) { return hand.damping_n_s_m * w; };
  const auto real = [&](double w) { return mass_kg * w * w - hand.stiffness_n_m; };
  double low = 0, high = M_PI / delay_s;
  for (int i = 0; i < 100; ++i) {
    const double w = 0.5 * (low + high);
    (w * delay_s < std::atan2(imaginary(w), real(w)) ? low : high) = w;
  }
  return std::hypot(imaginary(low), real(low));
}

}  // namespace

TEST_CASE("A held hand on a delayed wall is judged stable below the stiffness at which its root crosses, and unstable above") {
  const Hand hand = *hand_from_name(GENERATE("light", "reference", "firm"));
  const int delay_ticks = GENERATE(20, 60, 200);
  const SimPhantomOptions options = held_by(hand);
  const double mass_kg = hand.mass_kg + options.device_mass_kg;
  // A force held for a tick is effectively half a tick late.
  const double limit = boundary_n_m(mass_kg, hand, (delay_ticks + 0.5) * kTickS);
  CAPTURE(hand.mass_kg, delay_ticks, limit);
  constexpr double kLongS = 20;
  const auto fault = [&](double share) {
    const ClosedLoopResult reference = loop_on(wall(share * limit, 0), kPush, options, kLongS);
    return judge_loop(loop_on(wall(share * limit, delay_ticks), kPush, options, kLongS), reference, kRestTick).fault;
  };
  CHECK(fault(0.9) == LoopFault::none);
  CHECK((fault(1.1) == LoopFault::unrest || fault(1.1) == LoopFault::lost));
  CHECK(fault(3) != LoopFault::none);
}

TEST_CASE("A device with friction on a sampled wall is judged by the bound b > K T / 2") {
  SimPhantomOptions options = held_by({});
  options.device_mass_kg = 0.5;
  options.device_damping_n_s_m = 0.5;
  options.hand = *hand_from_name("reference");
  options.release_s = kRestTick * kTickS;
  // There the determinant of the map over a period is 1: the exact device under a held force.
  const double m = options.device_mass_kg, b = options.device_damping_n_s_m, e = std::exp(-b * kTickS / m);
  const double q = m / b * (1 - e), p = (kTickS - q) / b, r = (1 - e) / b;
  const double limit = (1 - e) / (r * q - p * e);
  CHECK(limit == Approx(2 * b / kTickS).epsilon(1e-3));
  const auto fault = [&](double share) {
    const ClosedLoopResult loop = loop_on(wall(share * limit, 0), kPush, options, 40);
    ClosedLoopResult calm = loop;  // the full model would come to rest at once
    for (std::size_t i = kRestTick; i < calm.ticks.size(); ++i)
      calm.ticks[i] = calm.ticks[kRestTick], calm.ticks[i].kinetic_j = 0;
    return judge_loop(loop, calm, kRestTick).fault;
  };
  CHECK(fault(0.7) == LoopFault::none);
  CHECK(fault(1.15) == LoopFault::unrest);
}

TEST_CASE("A limit cycle that is small beside the blow that began it is not stable") {
  // Near the intended position the wall is stiff, beyond the boundary; 0.04 mm further out it yields.
  const SimPhantomOptions options = held_by(*hand_from_name("light"));
  constexpr int kDelay = 60;
  const double limit = boundary_n_m(0.175, options.hand, (kDelay + 0.5) * kTickS);
  const auto law = [=](double, const std::deque<double>& z) {
    const double x = z[static_cast<std::size_t>(std::max(0, static_cast<int>(z.size()) - 1 - kDelay))] + 0.004;
    return -1.3 * limit * std::clamp(x, -4e-5, 4e-5);
  };
  const ClosedLoopResult reference = loop_on(wall(limit, 0), kPush, options, 6);
  const LoopVerdict verdict = judge_loop(loop_on(law, kPush, options, 6), reference, kRestTick);
  CAPTURE(verdict.rest.peak_to_peak_m);
  CHECK(verdict.rest.tail_m() < 0.25 * verdict.rest.peak_to_peak_m[0]);
  CHECK(verdict.fault == LoopFault::unrest);
}

TEST_CASE("A hand that is driven is stable however fast it moves, and is not when the display shakes it meanwhile") {
  std::vector<MotionPoint> points;
  for (int ms = 0; ms <= 1500; ++ms) points.push_back({ms * 1e-3, {0, 0, -0.006 * std::pow(std::sin(3 * M_PI * ms * 1e-3), 2)}});
  const Motion taps(points);
  const SimPhantomOptions options = held_by(*hand_from_name("light"));
  constexpr int kDelay = 30;
  constexpr std::size_t kStill = 1700;
  const double limit = boundary_n_m(0.175, options.hand, (kDelay + 0.5) * kTickS);
  const ClosedLoopResult reference = loop_on(wall(0.5 * limit, 0), taps, options, 4);
  CHECK(judge_loop(reference, reference, kStill).fault == LoopFault::none);
  CHECK(judge_loop(loop_on(wall(0.5 * limit, kDelay), taps, options, 4), reference, kStill).fault == LoopFault::none);
  // Unstable only while driven; at rest nothing remains of it.
  const Law shaking = [=](double t_s, const std::deque<double>& z) {
    return wall((t_s < 1.5 ? 2.5 : 0.1) * limit, t_s < 1.5 ? kDelay : 0)(t_s, z);
  };
  const LoopVerdict verdict =
      judge_loop(loop_on(shaking, taps, options, 6), loop_on(wall(2.5 * limit, 0), taps, options, 6), kStill);
  CAPTURE(verdict.shake.motion_m, verdict.shake.speed_m_s, verdict.rest.peak_to_peak_m);
  CHECK(verdict.fault == LoopFault::shakes);
}

TEST_CASE("A tool whose point stands still is not at rest while it turns, and shakes where it is turned to and fro") {
  const auto turning = [](double swing_rad, double decay_1_s) {
    ClosedLoopResult result;
    for (int n = 0; n < 2500; ++n) {
      LoopTick tick;
      const double t = n * kTickS;
      tick.turn = rotation_by(Vec3(swing_rad * std::exp(-decay_1_s * t) * std::sin(2 * M_PI * 5 * t), 0, 0));
      result.ticks.push_back(tick);
    }
    return result;
  };
  const ClosedLoopResult still = turning(0, 0);
  CHECK(judge_loop(still, still, kRestTick).fault == LoopFault::none);
  CHECK(judge_loop(turning(0.05, 0), still, kRestTick).fault == LoopFault::unrest);
  CHECK(judge_loop(turning(0.05, 4), turning(0.05, 3), kRestTick).fault == LoopFault::none);
  CHECK(judge_loop(turning(0.05, 4), still, kRestTick).fault == LoopFault::shakes);
  // About x the point on the z axis moves by the lever times the angle to either side.
  CHECK(judge_loop(turning(0.05, 0), still, kRestTick).rest.tail_m() == Approx(2 * kLeverM * std::sin(0.05)).epsilon(1e-3));
}
