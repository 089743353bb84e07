#include "bench/measure/gestures.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr double kGesturePressS = 0.3, kGestureTapHz = 3, kTapsS = 1.0, kLandS = 0.2, kGestureStrokeS = 1.0, kStrokeM = 0.020;

/// Depth and sideways offset of the hand's intention [m], over time.
using Wish = std::function<std::pair<double, double>(double t_s)>;

Wish wish_of(Gesture gesture, double depth_m) {
  const auto press = [](double t, double depth) { return depth * minimum_jerk(t / kGesturePressS); };
  switch (gesture) {
    case Gesture::tap:
      return [=](double t) {
        const double s = std::sin(std::numbers::pi * kGestureTapHz * t);
        const double depth = t < kTapsS ? 0.6 * depth_m * s * s : 0.2 * depth_m * minimum_jerk((t - kTapsS) / kLandS);
        return std::pair(depth, 0.0);
      };
    case Gesture::stroke:
      return [=](double t) {
        const double u = std::clamp((t - kGesturePressS) / kGestureStrokeS, 0.0, 1.0);
        return std::pair(press(t, 0.6 * depth_m), kStrokeM * 0.5 * (1 - std::cos(2 * std::numbers::pi * u)));
      };
    default:
      return [=](double t) { return std::pair(press(t, depth_m), 0.0); };
  }
}

}  // namespace

std::optional<Gesture> gesture_from_name(std::string_view name) {
  const auto at = std::find(kGestureNames.begin(), kGestureNames.end(), name);
  if (at == kGestureNames.end()) return std::nullopt;
  return static_cast<Gesture>(at - kGestureNames.begin());
}

Vec3 into_body(const Scene& scene) { return scene.body.planar ? Vec3(0, -1, 0) : Vec3(0, 0, -1); }

Vec3 start_of(const Scene& scene) {
  constexpr double kHomeAboveM = 0.020;  // home_of() of a touched scene
  if (scene.tool.contact == ContactKind::attach) return home_of(scene);
  return home_of(scene) + (kHomeAboveM - kGapM) * into_body(scene);
}

GesturePlan plan_gesture(const Scene& scene, Gesture gesture, double depth_m) {
  constexpr double kStandS = 0.2;  // time for driven motion to die down before it is judged
  const bool touch = scene.tool.contact == ContactKind::touch;
  const Vec3 into = into_body(scene), start = start_of(scene);
  const double end_s =
      gesture == Gesture::tap ? kTapsS + kLandS : kGesturePressS + (gesture == Gesture::stroke ? kGestureStrokeS : 0.0);
  const Wish wish = wish_of(gesture, depth_m + (touch ? kGapM : 0.0));
  std::vector<MotionPoint> points;
  for (int ms = 0; ms <= static_cast<int>(std::lround(end_s * 1e3)); ++ms) {
    const auto [depth, side] = wish(ms * 1e-3);
    points.push_back({ms * 1e-3, start + depth * into + side * Vec3::UnitX()});
  }
  const double still_s = end_s + kStandS;
  const double release_s = gesture == Gesture::tap      ? 0.75
                           : gesture == Gesture::stroke ? kGesturePressS + kGestureStrokeS / 4
                                                        : still_s;
  return {Motion(std::move(points), std::string(name_of(gesture))), still_s, release_s};
}

}  // namespace palpate
