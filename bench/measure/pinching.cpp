#include "bench/measure/pinching.hpp"

#include <cmath>

#include "bench/measure/gestures.hpp"

namespace palpate {
namespace {

constexpr double kAstrideS = 0.4, kCloseS = 0.4, kPullS = 1.5, kOpenS = 0.2, kLeaveS = 0.4;
constexpr double kDepthM = 0.022, kPullM = 0.01;

/// 0 before `begin_s`, 1 from `begin_s` + `takes_s` on.
double part(double t_s, double begin_s, double takes_s) { return minimum_jerk((t_s - begin_s) / takes_s); }

}  // namespace

Motion pinching(const ExaminedPlace& place, double closed) {
  const Vec3 normal = -place.into, across = normal.cross(place.aside);
  Mat3 upright;
  upright << place.aside, across, normal;
  std::vector<MotionPoint> points;
  MotionHolds holds;
  const double length_s = kPullEndsS + kOpenS + kLeaveS;
  for (int ms = 0; ms <= static_cast<int>(std::lround(1e3 * length_s)); ++ms) {
    const double t = ms * 1e-3;
    const double depth_m = (kDepthM + kGapM) * part(t, 0, kAstrideS) - kPullM * part(t, kPullBeginsS, kPullS) -
                           kDepthM * part(t, kPullEndsS + kOpenS, kLeaveS);
    points.push_back({t, place.start + depth_m * place.into});
    holds.orientations.emplace_back(upright);
    holds.openings.push_back(kAstrideOpening +
                             (closed - kAstrideOpening) * (part(t, kAstrideS, kCloseS) - part(t, kPullEndsS, kOpenS)));
  }
  return Motion(std::move(points), std::move(holds), "pinching");
}

}  // namespace palpate
