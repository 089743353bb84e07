// The frame of DHD and that of Palpate, converted here and nowhere else. Units are the same: metres, newtons, newton metres.
//
// D of DHD: x towards the person, y to the right, z up. W, for a device that stands before a person: x to the right, y away from
// the person, z up (docs/reference/frames-and-units.md). So p_W = R_WD p_D with the rows
//     W.x = D.y,   W.y = -D.x,   W.z = D.z.
// A rotation, so a torque is converted like a force. The library takes it about the point whose position it gives, which is the
// tool point.
#pragma once

#include <Eigen/Geometry>

#include "common/base/types.hpp"

namespace palpate::dhd {

inline Vec3 to_w(const Vec3& d) { return {d.y(), -d.x(), d.z()}; }
inline Vec3 to_d(const Vec3& w) { return {-w.y(), w.x(), w.z()}; }

/// Returns R_WT from the orientation frame, whose columns are the end effector's axes in D (matrix[row][column]). Held level
/// before a person, its x points to the person, y to the right, z up: these are z, x and y of T (device.hpp).
inline Eigen::Quaterniond orientation_from(const double matrix[3][3]) {
  Mat3 r_wt;
  for (int axis = 0; axis < 3; ++axis) {
    const int column = (axis + 1) % 3;
    r_wt.col(axis) = to_w({matrix[0][column], matrix[1][column], matrix[2][column]});
  }
  return Eigen::Quaterniond(r_wt).normalized();
}

}  // namespace palpate::dhd
