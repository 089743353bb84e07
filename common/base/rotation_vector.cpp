// These functions are not inline, because Eigen's quaternions cost compile time in every unit that instantiates them.
#include "common/base/rotation_vector.hpp"

#include <cmath>

namespace palpate {

Rotation rotation_by(const Vec3& v) {
  const double angle = v.norm();
  return angle > 0 ? Rotation(Eigen::AngleAxisd(angle, v / angle)) : Rotation(Rotation::Identity());
}

Vec3 rotation_vector(const Rotation& q, double past_pi_rad) {
  const double sign = q.w() < -0.5 * past_pi_rad ? -1 : 1, length = q.vec().norm();
  if (!(length > 0)) return Vec3::Zero();
  return (sign * 2 * std::atan2(length, sign * q.w()) / length) * q.vec();
}

Vec3 rotation_between(const Rotation& from, const Rotation& to) {
  return from.coeffs() == to.coeffs() ? Vec3(Vec3::Zero()) : rotation_vector(to * from.conjugate());
}

Rotation interpolate(const Rotation& from, const Rotation& to, double s) { return from.slerp(s, to); }

// Of unit vectors a and b: with their middle m = (a + b) / |a + b| the quaternion is (a . m, a x m). Eigen's FromTwoVectors
// computes a singular value decomposition.
Rotation shortest_rotation(const Vec3& from, const Vec3& to) {
  constexpr double kOpposite = 1e-9;
  const Vec3 begin = from.normalized(), sum = begin + to.normalized();
  Rotation turn;
  if (sum.norm() > kOpposite) {
    const Vec3 middle = sum.normalized();
    turn.w() = begin.dot(middle);
    turn.vec() = begin.cross(middle);
  } else {
    turn.w() = 0;
    turn.vec() = begin.unitOrthogonal();
  }
  return turn.normalized();
}

}  // namespace palpate
