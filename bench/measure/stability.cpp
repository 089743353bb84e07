#include "bench/measure/stability.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr auto kWindowTicks = static_cast<std::size_t>(kWindowS * 1e3);
constexpr std::size_t kEnds = 2;  // number of windows in the head, and in the tail

double peak_to_peak(std::span<const Vec3> position) {
  Vec3 low = position[0], high = position[0];
  for (const Vec3& x : position) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  return (high - low).norm();
}

/// Slope of ln p over the middles of the windows.
double growth(const std::vector<double>& p) {
  double n = 0, t = 0, y = 0, tt = 0, ty = 0;
  for (std::size_t k = 0; k < p.size(); ++k) {
    if (p[k] < kStillM) continue;
    const double at = static_cast<double>(k) * kWindowS, value = std::log(p[k]);
    n += 1;
    t += at;
    y += value;
    tt += at * at;
    ty += at * value;
  }
  return n < 2 ? 0 : (n * ty - t * y) / (n * tt - t * t);
}

/// Points of a tool that are judged, in its frame: one where it does not turn.
std::vector<Vec3> marks_of(std::span<const LoopTick> ticks) {
  const bool turns =
      std::ranges::any_of(ticks, [&](const LoopTick& tick) { return tick.turn.coeffs() != ticks.front().turn.coeffs(); });
  if (!turns) return {Vec3::Zero()};
  return {Vec3::Zero(), kLeverM * Vec3::UnitX(), kLeverM * Vec3::UnitZ()};
}

std::vector<Vec3> path_of(const Vec3& mark, std::span<const LoopTick> ticks) {
  std::vector<Vec3> path;
  for (const LoopTick& tick : ticks) path.push_back(mark.isZero(0) ? tick.position : tick.position + tick.turn * mark);
  return path;
}

double highest(std::span<const double> values) { return *std::max_element(values.begin(), values.end()); }
double tail_of(std::span<const double> windows) { return highest(windows.last(std::min(kEnds, windows.size()))); }

/// `power`: 1 for motion, 2 for energy, which grows with its square.
bool dies_out(std::span<const double> windows, int power, double allowed) {
  const std::size_t n = windows.size(), ends = std::min(kEnds, n / 2);
  if (ends == 0) return false;
  const double tail = highest(windows.last(ends));
  if (tail <= allowed) return true;
  const std::size_t third = n / 3;
  const bool goes_on = third < kEnds || tail <= std::pow(0.75, power) * highest(windows.subspan(third, n - ends - third));
  return goes_on && tail <= std::pow(0.25, power) * highest(windows.first(ends));
}

}  // namespace

double StabilityVerdict::tail_m() const { return tail_of(peak_to_peak_m); }
double StabilityVerdict::tail_j() const { return tail_of(kinetic_max_j); }

StabilityVerdict judge_motion(std::span<const Vec3> position, std::span<const double> kinetic_j, bool lost,
                              const RestBounds& still) {
  StabilityVerdict v;
  for (std::size_t at = 0; at < position.size(); at += kWindowTicks) {
    const std::size_t count = std::min(kWindowTicks, position.size() - at);
    if (count < kWindowTicks && at > 0 && !lost) break;
    v.peak_to_peak_m.push_back(peak_to_peak(position.subspan(at, count)));
    v.kinetic_max_j.push_back(highest(kinetic_j.subspan(at, count)));
  }
  v.growth_1_s = growth(v.peak_to_peak_m);
  v.stable = !lost && dies_out(v.peak_to_peak_m, 1, still.motion_m) && dies_out(v.kinetic_max_j, 2, still.kinetic_j);
  return v;
}

namespace {

Shake shake_of(const std::vector<Vec3>& position) {
  constexpr std::size_t kHalf = 50, kWhole = 2 * kHalf + 1;
  Shake shake;
  std::vector<Vec3> slow;
  if (position.size() < 2 * kWhole) return shake;
  shake.travel_m = peak_to_peak(position);
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < position.size(); ++i) {
    sum += position[i];
    if (i >= kWhole) sum -= position[i - kWhole];
    if (i + 1 >= kWhole) slow.push_back(sum / static_cast<double>(kWhole));
  }
  std::vector<Vec3> fast(slow.size());
  for (std::size_t i = 0; i < slow.size(); ++i) fast[i] = position[i + kHalf] - slow[i];
  for (std::size_t i = 0; i + kWhole <= fast.size(); ++i)
    shake.motion_m = std::max(shake.motion_m, peak_to_peak(std::span(fast).subspan(i, kWhole)));
  for (std::size_t i = 1; i < fast.size(); ++i)
    shake.speed_m_s = std::max(shake.speed_m_s, (fast[i] - fast[i - 1]).norm() / 1e-3);
  return shake;
}

StabilityVerdict judge_rest(const ClosedLoopResult& loop, std::size_t rest_tick, const RestBounds& still) {
  // A tool that was lost while driven is judged by its whole motion.
  const std::span ticks = std::span(loop.ticks).subspan(rest_tick < loop.ticks.size() ? rest_tick : 0);
  std::vector<double> kinetic_j;
  for (const LoopTick& tick : ticks) kinetic_j.push_back(tick.kinetic_j);
  StabilityVerdict worst;
  for (const Vec3& mark : marks_of(ticks)) {
    const StabilityVerdict v = judge_motion(path_of(mark, ticks), kinetic_j, loop.lost, still);
    const bool worse =
        worst.peak_to_peak_m.empty() || (worst.stable && !v.stable) || (worst.stable == v.stable && v.tail_m() > worst.tail_m());
    if (worse) worst = v;
  }
  return worst;
}

bool shakes(const Shake& shake, const Shake& reference) {
  return shake.motion_m > std::max({2 * reference.motion_m, reference.travel_m / 4, kStillM}) ||
         shake.speed_m_s > std::max(2 * reference.speed_m_s, reference.fastest_m_s / 4);
}

}  // namespace

Shake shake_of(std::span<const LoopTick> driven) {
  Shake shake;
  for (const Vec3& mark : marks_of(driven)) {
    const Shake of_mark = shake_of(path_of(mark, driven));
    shake.motion_m = std::max(shake.motion_m, of_mark.motion_m);
    shake.speed_m_s = std::max(shake.speed_m_s, of_mark.speed_m_s);
    shake.travel_m = std::max(shake.travel_m, of_mark.travel_m);
  }
  for (const LoopTick& tick : driven) shake.fastest_m_s = std::max(shake.fastest_m_s, tick.velocity.norm());
  return shake;
}

LoopVerdict judge_loop(const ClosedLoopResult& loop, const ClosedLoopResult& reference, std::size_t rest_tick, RestBounds still) {
  const StabilityVerdict calm = judge_rest(reference, rest_tick, still);
  still = {std::max(still.motion_m, 2 * calm.tail_m()), std::max(still.kinetic_j, 4 * calm.tail_j())};
  LoopVerdict v;
  v.rest = judge_rest(loop, rest_tick, still);
  const auto driven = [&](const ClosedLoopResult& r) { return std::span(r.ticks).first(std::min(rest_tick, r.ticks.size())); };
  v.shake = shake_of(driven(loop));
  for (const LoopTick& tick : loop.ticks) v.generated_j = std::max(v.generated_j, -tick.display_j);
  if (loop.lost)
    v.fault = LoopFault::lost;
  else if (!v.rest.stable)
    v.fault = LoopFault::unrest;
  else if (shakes(v.shake, shake_of(driven(reference))))
    v.fault = LoopFault::shakes;
  return v;
}

}  // namespace palpate
