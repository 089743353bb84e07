// The frame and units of HDAPI and those of Palpate, converted here and nowhere else.
//
// D of HDAPI: x to the right, y up, z towards the person, millimetres, newtons. W: z up (docs/reference/frames-and-units.md), and
// for a device that stands before a person: x to the right, y away from the person. So p_W = R_WD p_D with the rows
//     W.x = D.x,   W.y = -D.z,   W.z = D.y.
// A rotation, so a torque is converted like a force, to millinewton metres. The library states no point for it; it is taken to be
// that of the position.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>

#include "common/base/types.hpp"

namespace palpate::hd {

inline constexpr double kMetresPerMillimetre = 1e-3, kMilli = 1e3;  ///< kMilli: thousandths in a whole

inline Vec3 to_w(const Vec3& d) { return {d.x(), -d.z(), d.y()}; }
inline Vec3 to_d(const Vec3& w) { return {w.x(), w.z(), -w.y()}; }

inline Vec3 position_from(const double* mm) { return kMetresPerMillimetre * to_w({mm[0], mm[1], mm[2]}); }

inline void force_to(const Vec3& force_w, double* n) {
  const Vec3 force_d = to_d(force_w);
  std::copy_n(force_d.data(), 3, n);
}

inline void torque_to(const Vec3& torque_w, double* mnm) {
  const Vec3 torque_d = kMilli * to_d(torque_w);
  std::copy_n(torque_d.data(), 3, mnm);
}

/// Returns R_WT from the column-major 4 x 4 transform, whose columns are the stylus's axes in D, the same as those of T
/// (device.hpp).
inline Eigen::Quaterniond orientation_from(const double* transform) {
  Mat3 r_wt;
  for (int column = 0; column < 3; ++column) r_wt.col(column) = to_w(Eigen::Map<const Vec3>(transform + 4 * column));
  return Eigen::Quaterniond(r_wt).normalized();
}

}  // namespace palpate::hd
