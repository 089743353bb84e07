#include "bench/measure/stability.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr auto kWindowTicks = static_cast<std::size_t>(kWindowS * 1e3);

double peak_to_peak(std::span<const Vec3> position) {
  Vec3 low = position[0], high = position[0];
  for (const Vec3& x : position) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  return (high - low).norm();
}

/// Slope of ln p against the windows' middles.
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

double highest(std::span<const double> values) { return *std::max_element(values.begin(), values.end()); }

bool dies_out(std::span<const double> windows, double share, double floor) {
  constexpr std::size_t kEnds = 2;
  const std::size_t ends = std::min(kEnds, windows.size() / 2);
  return ends > 0 && highest(windows.last(ends)) <= std::max(share * highest(windows.first(ends)), floor);
}

}  // namespace

StabilityVerdict judge_motion(std::span<const Vec3> position, std::span<const double> kinetic_j, bool lost) {
  StabilityVerdict v;
  for (std::size_t at = 0; at < position.size(); at += kWindowTicks) {
    const std::size_t count = std::min(kWindowTicks, position.size() - at);
    if (count < kWindowTicks && at > 0 && !lost) break;
    v.peak_to_peak_m.push_back(peak_to_peak(position.subspan(at, count)));
    v.kinetic_max_j.push_back(highest(kinetic_j.subspan(at, count)));
  }
  v.growth_1_s = growth(v.peak_to_peak_m);
  v.stable = !lost && dies_out(v.peak_to_peak_m, 1.0 / 4, kStillM) && dies_out(v.kinetic_max_j, 1.0 / 16, kStillJ);
  return v;
}

}  // namespace palpate
