#include "bench/measure/handling.hpp"

#include <cmath>
#include <numbers>

#include "bench/measure/gestures.hpp"

namespace palpate {
namespace {

constexpr double kInS = 0.3, kPressS = 1.2, kRockS = 2.4, kStrokeS = 1.8, kTwistS = 1.9;
constexpr double kDegree = std::numbers::pi / 180;

/// Share of the depth, depth and way aside [m], and angles about the axes aside, across and along the normal [rad].
struct Held {
  double in = 0, depth = 0, aside = 0, rock = 0, nod = 0, twist = 0;
};

/// In within kInS, and up again within the last kInS of `length_s`.
double in_and_out(double t, double length_s) { return minimum_jerk(t / kInS) - minimum_jerk((t - length_s + kInS) / kInS); }

double wave(double t, double hz) { return std::sin(2 * std::numbers::pi * hz * t); }

Held held(double t) {
  if (t < kPressS) return {.in = in_and_out(t, kPressS), .depth = 0.008};
  if ((t -= kPressS) < kRockS) {
    const double in = in_and_out(t, kRockS);
    return {.in = in, .depth = 0.006, .rock = 12 * kDegree * in * wave(t, 1), .nod = 12 * kDegree * in * wave(t, 0.7)};
  }
  if ((t -= kRockS) < kStrokeS) {
    const double in = in_and_out(t, kStrokeS), along = std::clamp((t - kInS) / (kStrokeS - 2 * kInS), 0.0, 1.0);
    return {.in = in, .depth = 0.005, .aside = 0.0075 * (1 - std::cos(2 * std::numbers::pi * along)), .nod = 8 * kDegree * in};
  }
  t -= kStrokeS;
  const double in = in_and_out(t, kTwistS);
  return {.in = in, .depth = 0.006, .twist = 25 * kDegree * in * wave(t, 0.8)};
}

}  // namespace

Motion handling(const ExaminedPlace& place) {
  const Vec3 normal = -place.into, across = normal.cross(place.aside);
  Mat3 upright;
  upright << place.aside, across, normal;
  std::vector<MotionPoint> points;
  MotionHolds holds;
  const double length_s = kPressS + kRockS + kStrokeS + kTwistS;
  for (int ms = 0; ms <= static_cast<int>(std::lround(1e3 * length_s)); ++ms) {
    const Held at = held(ms * 1e-3);
    const double depth_m = at.in * (place.scale * at.depth + kGapM);
    points.push_back({ms * 1e-3, place.start + depth_m * place.into + place.scale * at.aside * place.aside});
    const Mat3 turned =
        (Eigen::AngleAxisd(at.twist, normal) * Eigen::AngleAxisd(at.rock, place.aside) * Eigen::AngleAxisd(at.nod, across))
            .toRotationMatrix() *
        upright;
    holds.orientations.emplace_back(turned);
  }
  return Motion(std::move(points), std::move(holds), "handling");
}

}  // namespace palpate
