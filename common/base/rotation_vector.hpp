// Rotations: the exponential map of rotation vectors and its inverse, and the shortest rotation between two directions.
//
//     exp(v): rotation by |v| about v / |v|          log(q): the v with exp(v) = q, |v| <= pi
#pragma once

#include "common/base/types.hpp"

namespace palpate {

/// exp(v) [rad].
Rotation rotation_by(const Vec3& v);

/// log(q) of a unit quaternion [rad]. q is replaced by -q, the same rotation, where its angle is above pi + `past_pi_rad`.
Vec3 rotation_vector(const Rotation& q, double past_pi_rad = 0);

/// Returns the v with `to` = exp(v) `from`; zero where both are the same to the bit.
Vec3 rotation_between(const Rotation& from, const Rotation& to);

/// Returns the rotation at the share `s` of the way from one to the other, with constant spin (spherical linear interpolation).
Rotation interpolate(const Rotation& from, const Rotation& to, double s);

/// Returns the rotation by the smallest angle that takes the direction of `from` to that of `to`; neither is zero. Between
/// opposite directions: by pi about some axis across them.
Rotation shortest_rotation(const Vec3& from, const Vec3& to);

}  // namespace palpate
