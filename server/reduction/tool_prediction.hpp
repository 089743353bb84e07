// Prediction of a tool's motion while a patch is in use: all assumptions about hands.
//
//     dead reckoned   x + v (t - t^2 / (2 T)), at rest after T = kDeadReckoningS: decelerating, without fresh samples
//     moved on        x + v t + a (t e - e^2 / 2), e = min(t, kAccelerationTimeS), at rest after kPredictionMostS: at the present
//                     velocity and acceleration, with fresh samples
//     from rest       kHandAccelerationMs2 t^2 / 2, at most kFromRestMostM
//
// The times and accelerations are those with which patches of lattices that were not used for tuning were most accurate
// (docs/notebook.md, 17, 22, 26); no hand was measured.
#pragma once

#include <vector>

#include "server/dynamics/integrator.hpp"

namespace palpate {

inline constexpr double kHandAccelerationMs2 = 0.4;              ///< acceleration of an exploring hand; tuned
inline constexpr double kHandAccelerationMostMs2 = 10;           ///< upper bound of a hand's acceleration: about g
inline constexpr double kFromRestMostM = 0.012;                  ///< largest distance reached by acceleration; tuned
inline constexpr double kAccelerationTimeS = 0.05;               ///< time for which a hand's acceleration lasts; tuned
inline const double kDeadReckoningS = seconds(Micros{100'000});  ///< T, in whole ticks; longer: late stations go too far
inline constexpr double kPredictionMostS = 0.25;  ///< no hand is predictable for longer; 0.75 s shook one (docs/notebook.md, 24)

/// Returns the tool `gone_s` after its last known state.
ToolAt dead_reckoned(const ToolAt& last, double gone_s);
/// Returns the tool `after_s` from now.
ToolAt moved_on(const ToolAt& now, const Vec3& acceleration_m_s2, double after_s);

/// Motion of a hand, smoothed of its tremor and of an encoder's rounding.
struct HandMotion {
  Vec3 velocity = Vec3::Zero(), acceleration = Vec3::Zero();  ///< now [m/s], [m/s^2]
  Vec3 back = Vec3::Zero();  ///< displacement beyond these at the end of the time it is predicted for: of a swing [m]
};
/// Returns the motion v t + a t^2 / 2 that begins with the hand's velocity and ends, after `horizon_s`, at the position of
/// moved_on(), displaced by `back`.
HandMotion expected_path(const HandMotion& hand, double horizon_s);

/// Return the distance [m] and speed [m/s] that a hand reaches from rest by accelerating.
double accelerated_distance(double time_s);
double accelerated_speed(double time_s);

/// Returns the likely displacement of the tool along each axis within `horizon_s` [m].
Vec3 expected_motion(const ToolAt& tool, double horizon_s);

/// Returns displacements of a hand that accelerates into the body while its velocity is dead-reckoned [m].
std::vector<Vec3> expected_indentations(const ToolAt& tool, const Vec3& inwards, double horizon_s);

/// Request for the places on the surface that a touching tool may slide to.
struct ExpectedSlide {
  double time_s = 0;                 ///< time ahead; 0: none requested
  bool from_rest = false;            ///< also for a tool that does not slide
  Vec3 acceleration = Vec3::Zero();  ///< of the hand [m/s^2]
};

/// Returns slides from the contact point [m]; `normal` is that of the surface. For a sliding tool its position at that time and
/// half-way; for a resting one two perpendicular directions, by a quarter of the distance that an accelerating hand covers: going
/// further is too unlikely to be worth it. If its acceleration leads elsewhere than its velocity, there as well.
std::vector<Vec3> expected_slides(const Vec3& velocity, const Vec3& normal, const ExpectedSlide& slide);

}  // namespace palpate
