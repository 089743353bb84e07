// Rotation vectors: the exponential map of rotations and its inverse.
//
//     exp(v): rotation by |v| about v / |v|          log(q): the v with exp(v) = q, |v| <= pi
#pragma once

#include <cmath>

#include "common/base/types.hpp"

namespace palpate {

/// exp(v) [rad].
inline Rotation rotation_by(const Vec3& v) {
  const double angle = v.norm();
  return angle > 0 ? Rotation(Eigen::AngleAxisd(angle, v / angle)) : Rotation(Rotation::Identity());
}

/// log(q) of a unit quaternion [rad]. q is replaced by -q, the same rotation, where its angle is above pi + `past_pi_rad`.
inline Vec3 rotation_vector(const Rotation& q, double past_pi_rad = 0) {
  const double sign = q.w() < -0.5 * past_pi_rad ? -1 : 1, length = q.vec().norm();
  if (!(length > 0)) return Vec3::Zero();
  return (sign * 2 * std::atan2(length, sign * q.w()) / length) * q.vec();
}

/// Returns the v with `to` = exp(v) `from`; zero where both are the same to the bit.
inline Vec3 rotation_between(const Rotation& from, const Rotation& to) {
  return from.coeffs() == to.coeffs() ? Vec3(Vec3::Zero()) : rotation_vector(to * from.conjugate());
}

}  // namespace palpate
