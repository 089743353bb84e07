#include "bench/measure/lump_trial.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "bench/measure/gestures.hpp"
#include "client/device/hand.hpp"
#include "common/base/minimum_jerk.hpp"

namespace palpate {
namespace {

constexpr double kLumpBlockM = 0.08, kLumpBlockHighM = 0.04;
constexpr double kMeanDepthM = 0.005, kPressSwingM = 0.0025, kPressInS = 0.5, kPressSwingS = 1, kHandTremorM = 1e-4;
constexpr int kPressSwings = 3;
constexpr std::uint64_t kHandSeed = 7;

}  // namespace

Scene lump_scene(double diameter_m, double stiffness_ratio) {
  const double radius_m = 0.5 * diameter_m;
  const std::string lump =
      diameter_m > 0 ? fmt::format(R"(, "lump": {{"center_m": [{0}, {0}, {1}], "radius_m": {2}, "stiffness_ratio": {3}}})",
                                   0.5 * kLumpBlockM, kLumpBlockHighM - kCoverM - radius_m, radius_m, stiffness_ratio)
                     : std::string();
  return read_scene(fmt::format(R"({{
    "name": "lump",
    "body": {{ "lattice": {{ "nodes": [11, 11, 6], "size_m": [{0}, {0}, {1}], "fixed_faces": ["z-"],
      "solid": {{ "young_pa": {2}, "poisson": 0.45 }} }}{3} }},
    "tool": {{ "contact": "touch", "radius_m": 0.012 }} }})",
                                kLumpBlockM, kLumpBlockHighM, kLumpYoungPa, lump),
                    fmt::format("a block with a lump of {:g} mm", 1e3 * diameter_m));
}

Motion lump_press(const Scene& scene) {
  const Tremor tremor(kHandTremorM, kHandSeed);
  const Vec3 start = start_of(scene);
  std::vector<MotionPoint> points;
  for (int tick = 0; tick <= std::lround(1e3 * (kPressInS + kPressSwings * kPressSwingS)); ++tick) {
    const double t_s = 1e-3 * tick, swinging_s = std::max(0.0, t_s - kPressInS);
    const double depth_m = (kMeanDepthM + kGapM) * minimum_jerk(std::min(1.0, t_s / kPressInS)) +
                           kPressSwingM * std::sin(2 * std::numbers::pi * swinging_s / kPressSwingS);
    points.push_back({t_s, start - Vec3(0, 0, depth_m) + tremor.offset(t_s)});
  }
  return Motion(std::move(points));
}

FeltStiffness felt_stiffness(std::span<const Vec3> position, std::span<const Vec3> force) {
  const auto begin = static_cast<std::size_t>(std::lround(1e3 * kPressInS));
  const std::size_t end = std::min(position.size(), force.size());
  double n = 0, x = 0, f = 0, xx = 0, ff = 0, xf = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const double depth = position[begin].z() - position[i].z(), up = force[i].z();
    n += 1;
    x += depth;
    f += up;
    xx += depth * depth;
    ff += up * up;
    xf += depth * up;
  }
  const double var_x = xx / n - x * x / (n * n), var_f = ff / n - f * f / (n * n), cov = xf / n - x * f / (n * n);
  return {cov / var_x, std::sqrt(std::max(0.0, var_f - cov * cov / var_x) / (var_x * (kLooks - 2)))};
}

double detection_index(const FeltStiffness& lump, const FeltStiffness& beside, double weber) {
  return std::abs(lump.stiffness_n_m - beside.stiffness_n_m) /
         std::hypot(weber * beside.stiffness_n_m, lump.spread_n_m, beside.spread_n_m);
}

double detectable_diameter_m(std::span<const IndexAt> indices) {
  double diameter_m = -1;
  IndexAt before;
  for (const IndexAt& at : indices) {
    if (at.index < 1)
      diameter_m = -1;
    else if (before.diameter_m == 0)
      diameter_m = at.diameter_m;
    else if (diameter_m < 0)
      diameter_m = before.diameter_m + (at.diameter_m - before.diameter_m) * (1 - before.index) / (at.index - before.index);
    before = at;
  }
  return diameter_m;
}

}  // namespace palpate
