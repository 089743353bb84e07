#include "server/reduction/tool_prediction.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {
namespace {

/// Returns (t e - e^2 / 2) a [m].
Vec3 by_acceleration(const Vec3& acceleration_m_s2, double time_s) {
  assert(time_s >= 0);
  const double e = std::min(time_s, kAccelerationTimeS);
  return (time_s - 0.5 * e) * e * acceleration_m_s2;
}

}  // namespace

ToolAt dead_reckoned(const ToolAt& last, double gone_s) {
  assert(gone_s >= 0);
  const double s = std::min(gone_s, kDeadReckoningS);
  return {last.position + (s - s * s / (2 * kDeadReckoningS)) * last.velocity, (1 - s / kDeadReckoningS) * last.velocity};
}

ToolAt moved_on(const ToolAt& now, const Vec3& acceleration_m_s2, double after_s) {
  const double t = std::min(after_s, kPredictionMostS);
  const Vec3 velocity = now.velocity + std::min(t, kAccelerationTimeS) * acceleration_m_s2;
  return {now.position + t * now.velocity + by_acceleration(acceleration_m_s2, t),
          after_s > kPredictionMostS ? Vec3(Vec3::Zero()) : velocity};
}

HandMotion expected_path(const HandMotion& hand, double horizon_s) {
  assert(horizon_s > 0);
  const Vec3 end = moved_on({Vec3::Zero(), hand.velocity}, hand.acceleration, horizon_s).position + hand.back;
  return {hand.velocity, 2 / (horizon_s * horizon_s) * (end - horizon_s * hand.velocity)};
}

double accelerated_distance(double time_s) { return std::min(0.5 * kHandAccelerationMs2 * time_s * time_s, kFromRestMostM); }

double accelerated_speed(double time_s) {
  return accelerated_distance(time_s) < kFromRestMostM ? kHandAccelerationMs2 * time_s : 0;
}

Vec3 expected_motion(const ToolAt& tool, double horizon_s) {
  constexpr double kMotionLeastM = 0.002;  // a resting hand may set off; more: rests count more relative to motion
  Vec3 far;
  for (int axis = 0; axis < 3; ++axis) far[axis] = std::hypot(tool.velocity[axis] * horizon_s, kMotionLeastM);
  return far;
}

std::vector<Vec3> expected_indentations(const ToolAt& tool, const Vec3& inwards, double horizon_s) {
  assert(std::abs(inwards.norm() - 1) < 1e-6 && horizon_s >= 0);
  std::vector<Vec3> displacements;
  for (const double part : {1.0 / 3, 2.0 / 3, 1.0})
    displacements.push_back(part * part * accelerated_distance(horizon_s) * inwards +
                            dead_reckoned({Vec3::Zero(), tool.velocity}, part * horizon_s).position);
  return displacements;
}

std::vector<Vec3> expected_slides(const Vec3& velocity, const Vec3& normal, const ExpectedSlide& slide) {
  assert(std::abs(normal.norm() - 1) < 1e-6 && slide.time_s >= 0);
  constexpr double kDistinctM = 5e-4;      // shorter slides count as the contact point itself
  constexpr double kFromRestShare = 0.25;  // of a hand's longest way; measured: all of it costs 4 to 6 dB (docs/notebook.md, 22)
  const Vec3 by_velocity = slide.time_s * velocity;
  const auto along = [&](const Vec3& m) { return m.cross(normal).norm() > kDistinctM; };
  std::vector<Vec3> displacements;
  if (along(by_velocity)) {
    displacements = {by_velocity, 0.5 * by_velocity};
  } else if (slide.time_s > 0 && slide.from_rest) {
    const Vec3 side = normal.unitOrthogonal();
    const double far = kFromRestShare * accelerated_distance(slide.time_s);
    displacements = {far * side, far * normal.cross(side)};
  }
  Vec3 beside = by_acceleration(slide.acceleration, slide.time_s);
  beside /= std::max(1.0, beside.norm() / kFromRestMostM);
  if (along(beside) && along(by_velocity + beside)) displacements.push_back(by_velocity + beside);
  return displacements;
}

}  // namespace palpate
