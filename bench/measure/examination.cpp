#include "bench/measure/examination.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/measure/gestures.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr double kDeepM = 0.010, kLightM = 0.006, kAsideM = 0.015;
constexpr double kInS = 0.3, kTapHz = 3, kSwingHz = 5, kSwingDamping = 0.2;
constexpr double kPressS = 1.2, kStrokeS = 1.8, kTapS = 1.0, kReleaseS = 1.2;
constexpr double kHomeAboveM = 0.020;  // home_of() of a scene that is touched

struct Offset {
  double depth_m = 0, aside_m = 0;
};

/// In within kInS, and up again from `until_s` on.
double in_and_out(double t, double until_s) { return minimum_jerk(t / kInS) - minimum_jerk((t - until_s) / kInS); }

double swing_back(double t) {
  const double omega = 2 * std::numbers::pi * kSwingHz, damped = omega * std::sqrt(1 - kSwingDamping * kSwingDamping);
  return std::exp(-kSwingDamping * omega * t) * (std::cos(damped * t) + kSwingDamping * omega / damped * std::sin(damped * t));
}

Offset offset(double t) {
  constexpr double kHeldS = 0.4, kAlongS = 1.0;
  if (t < kPressS) return {kDeepM * in_and_out(t, kInS + kHeldS)};
  if ((t -= kPressS) < kStrokeS) {
    const double along = std::clamp((t - kInS) / kAlongS, 0.0, 1.0);
    return {kLightM * in_and_out(t, kInS + kAlongS), kAsideM * 0.5 * (1 - std::cos(2 * std::numbers::pi * along))};
  }
  if ((t -= kStrokeS) < kTapS) return {kLightM * std::pow(std::sin(std::numbers::pi * kTapHz * t), 2)};
  constexpr double kLetGoS = 0.5;
  t -= kTapS;
  return {kDeepM * (t < kLetGoS ? minimum_jerk(t / kInS) : swing_back(t - kLetGoS))};
}

}  // namespace

Motion examination(const Scene& scene) {
  const bool touch = scene.tool.contact == ContactKind::touch;
  const Vec3 into = into_body(scene), start = home_of(scene) + (touch ? kHomeAboveM - kGapM : 0.0) * into;
  const double deeper = touch ? (kDeepM + kGapM) / kDeepM : 1.0;
  std::vector<MotionPoint> points;
  const int ticks = static_cast<int>(std::lround(1e3 * (kPressS + kStrokeS + kTapS + kReleaseS)));
  for (int ms = 0; ms <= ticks; ++ms) {
    const Offset at = offset(ms * 1e-3);
    points.push_back({ms * 1e-3, start + deeper * at.depth_m * into + at.aside_m * Vec3::UnitX()});
  }
  return Motion(std::move(points), "examination");
}

}  // namespace palpate
