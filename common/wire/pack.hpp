// Number formats of the wire: fixed-point positions, float32, 64-bit words in halves, 16-bit steps of a shared size.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "common/base/limits.hpp"
#include "common/base/rotation_vector.hpp"
#include "common/base/tool_pose.hpp"
#include "common/base/tool_shape.hpp"
#include "common/base/types.hpp"
#include "common/wire/body_mesh.hpp"
#include "wire_generated.h"

namespace palpate::pack {

inline constexpr double kPositionStepM = 0x1p-27;  ///< a power of two, so that a decoded position is exact
inline constexpr double kMaxMicros = 1e16;         ///< instants lie within +- this (317 years)
inline constexpr int kShortMax = 32767;
inline constexpr int kWeightMax = 65535;
inline constexpr double kOpeningMost = 65535;
inline constexpr float kCouplingStep = 1.0F / kShortMax;                        ///< step of D_ij / sqrt(D_ii D_jj)
inline constexpr float kVelocityStep = 0x1p-14F, kAccelerationStep = 0x1p-10F;  ///< for other tools [m/s], [m/s^2]
inline constexpr double kComplianceUnit_m_n = 0x1p-10;                          ///< of halves
inline constexpr double kSmallestStep = 1e-9;  ///< for 16-bit numbers; keeps the step exact when the numbers are rounding noise

/// Largest angle of a Turn. The quaternion q of an angle just above pi is kept, not replaced by -q: what is encoded twice is the
/// same.
inline constexpr double kTurnPastPiRad = 0.002, kTurnMostRad = std::numbers::pi + kTurnPastPiRad;
inline constexpr double kTurnStepRad = kTurnMostRad / kShortMax;
inline constexpr double kTurnRoundingRad = 2 * kTurnStepRad;  ///< tolerance for the length of a received rotation vector

/// Converts numbers, and remembers whether all could be encoded.
class Packer {
 public:
  bool ok() const { return ok_; }
  void require(bool condition) { ok_ = ok_ && condition; }

  float number(double value) {
    require(std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()));
    return ok_ ? static_cast<float>(value) : 0.0f;
  }
  wire::Vec vec(const Vec3& v) { return {number(v.x()), number(v.y()), number(v.z())}; }
  /// Converts the symmetric part.
  wire::Sym sym(const Mat3& m) {
    return {number(m(0, 0)),
            number(0.5 * (m(1, 0) + m(0, 1))),
            number(m(1, 1)),
            number(0.5 * (m(2, 0) + m(0, 2))),
            number(0.5 * (m(2, 1) + m(1, 2))),
            number(m(2, 2))};
  }
  wire::Point point(const Vec3& v) { return {coordinate(v.x()), coordinate(v.y()), coordinate(v.z())}; }
  wire::Turn turn(const Rotation& q) {
    require(is_unit(q));
    const Vec3 v = ok_ ? rotation_vector(q, kTurnPastPiRad) : Vec3(Vec3::Zero());
    return {turn_steps(v.x()), turn_steps(v.y()), turn_steps(v.z())};
  }
  wire::Sphere sphere(const ToolSphere& s) {
    require(s.centre.cwiseAbs().maxCoeff() <= kMaxToolReachM + kToolStepM && s.radius_m >= 0 &&
            s.radius_m <= kMaxToolReachM + kToolStepM);
    const auto steps = [&](double metres) { return ok_ ? std::lround(metres / kToolStepM) : 0; };
    return {static_cast<std::int16_t>(steps(s.centre.x())), static_cast<std::int16_t>(steps(s.centre.y())),
            static_cast<std::int16_t>(steps(s.centre.z())), static_cast<std::uint16_t>(steps(s.radius_m))};
  }
  wire::Jaw jaw(const ToolSphere& s) {
    require(std::abs(s.hinge_m) <= kMaxToolReachM + kToolStepM && std::abs(s.swing_rad) <= kMaxSwingRad);
    require(std::abs(s.slide_m) <= kMaxToolReachM + kToolStepM && !(s.on_jaw() && s.slide_m != 0));
    if (!ok_) return {};
    return {static_cast<std::int16_t>(std::lround(s.hinge_m / kToolStepM)),
            static_cast<std::int16_t>(std::lround(s.swing_rad / kSwingStepRad)),
            static_cast<std::int16_t>(std::lround(s.slide_m / kToolStepM))};
  }
  std::uint16_t opening(double share) {
    require(share >= 0 && share <= 1);
    return ok_ ? static_cast<std::uint16_t>(std::lround(share * kOpeningMost)) : std::uint16_t{0};
  }
  /// Converts a mesh's rest position to steps in 24 bits.
  std::uint32_t rest(double metres) {
    require(std::abs(metres) <= kWorldExtentM);
    return ok_ ? static_cast<std::uint32_t>(rest_steps(metres)) & 0xffffff : 0;
  }
  static wire::Wide wide(std::uint64_t v) { return {static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(v >> 32)}; }
  wire::Wide time(Micros t) {
    require(std::abs(static_cast<double>(t.count())) <= kMaxMicros);
    return wide(static_cast<std::uint64_t>(t.count()));
  }
  std::uint32_t duration(Micros t) {
    require(t.count() >= 0 && t.count() <= std::numeric_limits<std::uint32_t>::max());
    return ok_ ? static_cast<std::uint32_t>(t.count()) : 0;
  }

 private:
  std::int32_t coordinate(double metres) {
    require(std::abs(metres) <= kWorldExtentM);
    return ok_ ? static_cast<std::int32_t>(std::lround(metres / kPositionStepM)) : 0;
  }

  static std::int16_t turn_steps(double angle) { return static_cast<std::int16_t>(std::lround(angle / kTurnStepRad)); }

  bool ok_ = true;
};

/// Returns the step size that maps the largest of some numbers to +-32767. Encoding decoded numbers gives the same step.
inline float short_step(double largest) { return static_cast<float>(std::max(largest / kShortMax, kSmallestStep)); }
inline std::int16_t to_short(double value, float step) {
  const double steps = std::round(value / static_cast<double>(step));
  return static_cast<std::int16_t>(std::clamp(steps, -double{kShortMax}, double{kShortMax}));
}

inline wire::Steps to_steps(const Vec3& v, float step) {
  return {to_short(v.x(), step), to_short(v.y(), step), to_short(v.z(), step)};
}
inline Vec3 from(const wire::Steps& s, float step) { return Vec3(s.x(), s.y(), s.z()) * static_cast<double>(step); }

inline ToolSphere from(const wire::Sphere& s) { return {kToolStepM * Vec3(s.x(), s.y(), s.z()), kToolStepM * s.radius()}; }
inline void set(ToolSphere& sphere, const wire::Jaw& jaw) {
  sphere.hinge_m = kToolStepM * jaw.hinge();
  sphere.swing_rad = kSwingStepRad * jaw.swing();
  sphere.slide_m = kToolStepM * jaw.slide();
}
inline double opening_from(std::uint16_t steps) { return steps / kOpeningMost; }
inline std::uint64_t from(const wire::Wide& w) { return std::uint64_t{w.high()} << 32 | w.low(); }
inline Micros time_from(const wire::Wide& w) { return Micros{static_cast<std::int64_t>(from(w))}; }
inline Vec3 from(const wire::Vec& v) { return {v.x(), v.y(), v.z()}; }
inline Vec3 from(const wire::Point& p) { return Vec3(p.x(), p.y(), p.z()) * kPositionStepM; }
inline Vec3 vector_of(const wire::Turn& t) { return kTurnStepRad * Vec3(t.x(), t.y(), t.z()); }
inline Rotation from(const wire::Turn& t) { return rotation_by(vector_of(t)); }
inline Mat3 from(const wire::Sym& s) {
  Mat3 m;
  m << s.xx(), s.yx(), s.zx(), s.yx(), s.yy(), s.zy(), s.zx(), s.zy(), s.zz();
  return m;
}

}  // namespace palpate::pack
