#include "bench/measure/tools_apart.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/measure/upper_side.hpp"
#include "common/base/error.hpp"
#include "common/base/minimum_jerk.hpp"

namespace palpate {
namespace {

constexpr double kApartAboveM = 0.003, kApartDeepM = 0.008, kSwingM = 0.004;
constexpr double kApartDownS = 0.4, kStaggerS = 0.1, kStaggerMostS = 0.5;

}  // namespace

Eigen::Vector2d place_apart(int k, int count, double apart_m) {
  if (count <= 2) return {count == 1 ? 0.0 : (k - 0.5) * apart_m, 0.0};
  constexpr double kGoldenAngle = 2.399963229728653;
  constexpr double kDensity = 0.55;  // neighbours on a spiral of unit scale are about 1 / kDensity apart or more
  const double radius = kDensity * apart_m * std::sqrt(k + 0.5);
  return radius * Eigen::Vector2d(std::cos(k * kGoldenAngle), std::sin(k * kGoldenAngle));
}

std::vector<Motion> tools_apart(const Scene& scene, int count, double apart_m, double duration_s, double slide_m) {
  const Vec3 middle = home_of(scene);
  std::vector<Motion> motions;
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector2d place = middle.head<2>() + place_apart(k, count, apart_m);
    const auto top = height_above(scene.body, place.x(), place.y());
    if (!top)
      throw InputError("tool " + std::to_string(k + 1) + " of " + std::to_string(count), "would be beside the body",
                       "fewer tools, or a smaller distance between them");
    const double begin_s = std::min(kStaggerS * k, kStaggerMostS);
    const double hz = 0.7 + 0.8 * std::fmod(0.618 * k, 1.0);
    std::vector<MotionPoint> points;
    const int ms = static_cast<int>(std::lround(duration_s * 1e3));
    for (int i = 0; i <= ms; ++i) {
      const double t = i * 1e-3, down_s = t - begin_s;
      const double swing = std::sin(2 * std::numbers::pi * hz * std::max(0.0, down_s - kApartDownS));
      const double depth = (kApartAboveM + kApartDeepM) * minimum_jerk(down_s / kApartDownS) + kSwingM * swing;
      const double slid_m = k % 2 == 0 ? slide_m * swing : 0.0;
      points.push_back({t, Vec3(place.x(), place.y() + slid_m, *top + kApartAboveM - depth)});
    }
    motions.emplace_back(std::move(points));
  }
  return motions;
}

}  // namespace palpate
