// A force and a torque about one point, and the small motion along which they do work:
//     dW = F . dx + T . dphi          dx of that point, dphi the rotation vector (rotation_vector.hpp)
#pragma once

#include "common/base/types.hpp"

namespace palpate {

struct Wrench {
  Vec3 force = Vec3::Zero();   ///< F [N]
  Vec3 torque = Vec3::Zero();  ///< T, about the tool point unless a name says otherwise [N m]
  Wrench() = default;
  template <class Force>
  Wrench(const Eigen::MatrixBase<Force>& force_n) : force(force_n) {}  // NOLINT: a force alone
  Wrench(const Vec3& force_n, const Vec3& torque_nm) : force(force_n), torque(torque_nm) {}
  bool finite() const { return force.allFinite() && torque.allFinite(); }
  bool zero() const { return force.isZero(0) && torque.isZero(0); }
  Wrench& operator+=(const Wrench& other) { return *this = {force + other.force, torque + other.torque}; }
  Wrench& operator*=(double share) { return *this = {share * force, share * torque}; }
};
inline Wrench operator+(const Wrench& a, const Wrench& b) { return {a.force + b.force, a.torque + b.torque}; }
inline Wrench operator-(const Wrench& a, const Wrench& b) { return {a.force - b.force, a.torque - b.torque}; }
inline Wrench operator*(double share, const Wrench& w) { return {share * w.force, share * w.torque}; }

/// Returns the wrench with zero for a part that is not finite.
inline Wrench finite_parts(const Wrench& w) {
  return {w.force.allFinite() ? w.force : Vec3(Vec3::Zero()), w.torque.allFinite() ? w.torque : Vec3(Vec3::Zero())};
}

/// Returns the largest s <= 1 for which s F and s T are within their limits; a limit that is not above 0 is none. One scale for
/// both keeps the line of action, and a wrench that has a potential still has one (docs/decisions/0077-torque.md).
double share_within(const Wrench& w, double most_n, double most_nm);
inline Wrench limited_to(const Wrench& w, double most_n, double most_nm) {
  const double share = share_within(w, most_n, most_nm);
  return share < 1 ? share * w : w;
}

/// A displacement of the tool point and a rotation.
struct SmallMotion {
  Vec3 way = Vec3::Zero();    ///< dx [m]
  Vec3 angle = Vec3::Zero();  ///< dphi [rad]
};

}  // namespace palpate
