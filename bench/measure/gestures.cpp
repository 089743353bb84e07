#include "bench/measure/gestures.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "bench/measure/upper_side.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr double kGesturePressS = 0.3, kGestureTapHz = 3, kTapsS = 1.0, kLandS = 0.2, kGestureStrokeS = 1.0, kStrokeM = 0.020,
                 kRockS = 1.0, kRockRad = 0.21, kTwistS = 0.5, kTwistRad = 0.44, kInsertS = 0.6, kInsertDepths = 2.5,
                 kInsertedS = 0.4;

/// Where the hand wants the tool.
struct Wish {
  double depth_m = 0, side_m = 0;
  double rock_rad = 0, twist_rad = 0;  ///< about x, and about the direction into the body
};
using WishAt = std::function<Wish(double t_s)>;

WishAt wish_of(Gesture gesture, double depth_m) {
  const auto press = [](double t, double depth) { return depth * minimum_jerk(t / kGesturePressS); };
  switch (gesture) {
    case Gesture::tap:
      return [=](double t) -> Wish {
        const double s = std::sin(std::numbers::pi * kGestureTapHz * t);
        const double depth = t < kTapsS ? 0.6 * depth_m * s * s : 0.2 * depth_m * minimum_jerk((t - kTapsS) / kLandS);
        return {.depth_m = depth};
      };
    case Gesture::stroke:
      return [=](double t) -> Wish {
        const double u = std::clamp((t - kGesturePressS) / kGestureStrokeS, 0.0, 1.0);
        return {.depth_m = press(t, 0.6 * depth_m), .side_m = kStrokeM * 0.5 * (1 - std::cos(2 * std::numbers::pi * u))};
      };
    case Gesture::rock:
      return [=](double t) -> Wish {
        const double u = std::clamp((t - kGesturePressS) / kRockS, 0.0, 1.0);
        return {.depth_m = press(t, 0.6 * depth_m), .rock_rad = kRockRad * std::sin(2 * std::numbers::pi * minimum_jerk(u))};
      };
    case Gesture::twist:
      return [=](double t) -> Wish {
        return {.depth_m = press(t, 0.6 * depth_m), .twist_rad = kTwistRad * minimum_jerk((t - kGesturePressS) / kTwistS)};
      };
    case Gesture::insert:
    case Gesture::withdraw:
      return [=](double t) -> Wish {
        const double up = gesture == Gesture::insert ? 0 : 0.5 * minimum_jerk((t - kInsertS - kInsertedS) / kInsertS);
        return {.depth_m = kInsertDepths * depth_m * (minimum_jerk(t / kInsertS) - up)};
      };
    default:
      return [=](double t) -> Wish { return {.depth_m = press(t, depth_m)}; };
  }
}

/// Duration of the motion.
double end_of(Gesture gesture) {
  switch (gesture) {
    case Gesture::tap:
      return kTapsS + kLandS;
    case Gesture::stroke:
      return kGesturePressS + kGestureStrokeS;
    case Gesture::rock:
      return kGesturePressS + kRockS;
    case Gesture::twist:
      return kGesturePressS + kTwistS;
    case Gesture::insert:
      return kInsertS;
    case Gesture::withdraw:
      return 2 * kInsertS + kInsertedS;
    default:
      return kGesturePressS;
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
  if (scene.tool.contact == ContactKind::attach) return home_of(scene);
  const Scene hanging = as_it_hangs(scene);
  return place_below(hanging.body, home_of(hanging)) - kGapM * into_body(scene);
}

GesturePlan plan_gesture(const Scene& scene, Gesture gesture, double depth_m) {
  constexpr double kStandS = 0.2;  // time for driven motion to die down before it is judged
  const bool touch = scene.tool.contact == ContactKind::touch;
  const Vec3 into = into_body(scene), start = start_of(scene);
  const double end_s = end_of(gesture);
  const WishAt wish_at = wish_of(gesture, depth_m + (touch ? kGapM : 0.0));
  std::vector<MotionPoint> points;
  MotionHolds holds;
  for (int ms = 0; ms <= static_cast<int>(std::lround(end_s * 1e3)); ++ms) {
    const Wish wish = wish_at(ms * 1e-3);
    points.push_back({ms * 1e-3, start + wish.depth_m * into + wish.side_m * Vec3::UnitX()});
    if (scene.tool.has_body())
      holds.orientations.emplace_back(Eigen::AngleAxisd(wish.twist_rad, into) * Eigen::AngleAxisd(wish.rock_rad, Vec3::UnitX()));
  }
  const double still_s = end_s + kStandS;
  const double release_s = gesture == Gesture::tap      ? 0.75
                           : gesture == Gesture::stroke ? kGesturePressS + kGestureStrokeS / 4
                                                        : still_s;
  return {Motion(std::move(points), std::move(holds), std::string(name_of(gesture))), still_s, release_s};
}

}  // namespace palpate
