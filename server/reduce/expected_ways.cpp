#include "server/reduce/expected_ways.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "server/body/coasting.hpp"

namespace palpate {
namespace {

constexpr double kFarthestM = 0.012;

}  // namespace

double sped_up(double time_s) { return std::min(0.5 * kHandMs2 * time_s * time_s, kFarthestM); }

double speed_of_speeding_up(double time_s) { return sped_up(time_s) < kFarthestM ? kHandMs2 * time_s : 0; }

Vec3 way_of_speeding_up(const Vec3& acceleration_m_s2, double time_s, double speeds_up_s) {
  const double e = std::min(time_s, speeds_up_s);
  return (time_s - 0.5 * e) * e * acceleration_m_s2;
}

Vec3 expected_motion(const ToolAt& tool, double bridge_s) {
  constexpr double kLeastM = 0.002;
  Vec3 far;
  for (int axis = 0; axis < 3; ++axis) far[axis] = std::hypot(tool.velocity[axis] * bridge_s, kLeastM);
  return far;
}

std::vector<Vec3> expected_dents(const ToolAt& tool, const Vec3& inwards, double bridge_s) {
  std::vector<Vec3> ways;
  for (const double part : {1.0 / 3, 2.0 / 3, 1.0})
    ways.push_back(part * part * sped_up(bridge_s) * inwards + coasted(tool.velocity, part * bridge_s));
  return ways;
}

std::vector<Vec3> expected_slides(const Vec3& velocity, const Vec3& normal, const ExpectedSlide& slide) {
  constexpr double kHardlyM = 5e-4, kSeldom = 0.25;  // of as far as a hand could
  const Vec3 way = slide.time_s * velocity;
  const auto along = [&](const Vec3& m) { return m.cross(normal).norm() > kHardlyM; };
  std::vector<Vec3> ways;
  if (along(way)) {
    ways = {way, 0.5 * way};
  } else if (slide.time_s > 0 && slide.from_rest) {
    const Vec3 side = normal.unitOrthogonal();
    const double far = kSeldom * sped_up(slide.time_s);
    ways = {far * side, far * normal.cross(side)};
  }
  Vec3 beside = way_of_speeding_up(slide.acceleration, slide.time_s, kSlideSpeedsUpS);
  beside /= std::max(1.0, beside.norm() / kFarthestM);
  if (along(beside) && along(way + beside)) ways.push_back(way + beside);
  return ways;
}

}  // namespace palpate
