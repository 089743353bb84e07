// The receiver's checks: stores the first fault of a message.
#pragma once

#include <cmath>
#include <string_view>

#include "common/base/plain_text.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/pack.hpp"

namespace palpate {

class MessageValidator {
 public:
  WireFault fault() const { return fault_; }
  bool ok() const { return fault_ == WireFault::none; }

  void that(bool condition, WireFault otherwise = WireFault::out_of_range) {
    if (ok() && !condition) fault_ = otherwise;
  }
  void number(double v, double low, double high) {
    that(std::isfinite(v), WireFault::not_finite);
    that(v >= low && v <= high);
  }
  void vec(const Vec3& v, double limit) {
    for (int i = 0; i < 3; ++i) number(v[i], -limit, limit);
  }
  void position(const Vec3& v) { vec(v, kWorldExtentM); }
  void force(const Vec3& v) { vec(v, kMaxForceN); }
  void torque(const Vec3& v) { vec(v, kMaxTorqueNM); }
  void turn(const wire::Turn& t) { that(pack::vector_of(t).norm() <= pack::kTurnMostRad + pack::kTurnRoundingRad); }
  /// Returns the sphere; `jaw`: null if none of its tool moves with the opening.
  ToolSphere sphere(const wire::Sphere& s, const wire::Jaw* jaw) {
    ToolSphere sphere = pack::from(s);
    if (jaw) pack::set(sphere, *jaw);
    vec(sphere.centre, kMaxToolReachM + kToolStepM);
    number(sphere.radius_m, 0, kMaxToolReachM + kToolStepM);
    number(sphere.hinge_m, -kMaxToolReachM - kToolStepM, kMaxToolReachM + kToolStepM);
    number(sphere.swing_rad, -kMaxSwingRad, kMaxSwingRad);
    number(sphere.slide_m, -kMaxToolReachM - kToolStepM, kMaxToolReachM + kToolStepM);
    that(!(sphere.on_jaw() && sphere.slide_m != 0));
    return sphere;
  }
  void time(Micros t) { number(static_cast<double>(t.count()), -pack::kMaxMicros, pack::kMaxMicros); }
  /// Text appears in logs, files and on screens: bounded, UTF-8, and completely visible.
  void text(std::string_view s, std::size_t least, std::size_t most) {
    that(s.size() >= least && s.size() <= most);
    that(is_plain_text(s));
  }
  void name(std::string_view s, std::size_t least) {
    text(s, least, kMaxNameBytes);
    that(is_plain_name(s));
  }

 private:
  WireFault fault_ = WireFault::none;
};

}  // namespace palpate
