#include "bench/measure/insertion.hpp"

#include <cmath>

#include "bench/measure/gestures.hpp"

namespace palpate {

Motion insertion(const ExaminedPlace& place, double depth_m, double peak_m_s) {
  constexpr double kAboveM = 0.005, kRestS = 0.3, kPeakOverMean = 1.875;
  const Vec3 normal = -place.into;
  const Vec3 begin = place.start + (kGapM - kAboveM) * place.into;
  Mat3 upright;
  upright << place.aside, normal.cross(place.aside), normal;
  const double way_m = kAboveM + depth_m, way_s = kPeakOverMean * way_m / peak_m_s;
  std::vector<MotionPoint> points;
  MotionHolds holds;
  for (int ms = 0; ms * 1e-3 <= 2 * (way_s + kRestS); ++ms) {
    const double t = ms * 1e-3 - kRestS;
    points.push_back(
        {ms * 1e-3, begin + way_m * (minimum_jerk(t / way_s) - minimum_jerk((t - way_s - kRestS) / way_s)) * place.into});
    holds.orientations.emplace_back(upright);
  }
  return Motion(std::move(points), std::move(holds), "insertion");
}

}  // namespace palpate
