// Prediction of a tool's motion while a patch lasts: all that is taken for granted of hands.
//
//     dead reckoned   x + v (t - t^2 / (2 T)), at rest after T = kDeadReckoningS: on as it went, slower and slower, when nothing
//                     is heard of it
//     moved on        x + v t + a (t e - e^2 / 2), e = min(t, kAccelerationTimeS), at rest after kPredictionMostS: on as it goes
//                     and speeds up, when it is heard
//     from rest       kHandAccelerationMs2 t^2 / 2, at most kFromRestMostM
//
// The times and accelerations are those with which patches of lattices nobody had looked at were truest
// (docs/notebook.md, 17, 22, 26); no hand was measured.
#pragma once

#include <vector>

#include "server/body/integrator.hpp"

namespace palpate {

inline constexpr double kHandAccelerationMs2 = 0.4;              ///< that a hand speeds up by which explores; tuned
inline constexpr double kHandAccelerationMostMs2 = 10;           ///< that no hand speeds up by more than: about g
inline constexpr double kFromRestMostM = 0.012;                  ///< how far it gets by speeding up; tuned
inline constexpr double kAccelerationTimeS = 0.05;               ///< how long it goes on to speed up, or slow down; tuned
inline const double kDeadReckoningS = seconds(Micros{100'000});  ///< T, of whole ticks; longer: stations that are late go too far
inline constexpr double kPredictableS = 0.15;     ///< within which no hand gets far beside where it would get by itself; tuned
inline constexpr double kPredictionMostS = 0.25;  ///< no hand is known for longer; 0.75 s shook one (docs/notebook.md, 24)

/// `gone_s` after the last that was heard.
ToolAt dead_reckoned(const ToolAt& last, double gone_s);
/// `after_s` from now.
ToolAt moved_on(const ToolAt& now, const Vec3& acceleration_m_s2, double after_s);

/// How a hand moves now, its tremor and what an encoder rounds smoothed out.
struct HandMotion {
  Vec3 velocity = Vec3::Zero(), acceleration = Vec3::Zero();  ///< [m/s], [m/s^2]
};
/// The motion v t + a t^2 / 2 that begins with the hand's velocity and ends, `horizon_s` from now, where moved_on() has it.
HandMotion expected_path(const HandMotion& hand, double horizon_s);

/// How far a hand gets from rest that speeds up [m], and how fast it then is [m/s].
double accelerated_distance(double time_s);
double accelerated_speed(double time_s);

/// How far the tool is likely to move along each axis in `horizon_s` [m].
Vec3 expected_motion(const ToolAt& tool, double horizon_s);

/// Displacements of a hand that speeds up into the body while its velocity is dead-reckoned [m].
std::vector<Vec3> expected_indentations(const ToolAt& tool, const Vec3& inwards, double horizon_s);

/// Where on the surface a tool that touches may get to.
struct ExpectedSlide {
  double time_s = 0;                 ///< in this time; 0: nobody asks
  bool from_rest = false;            ///< ask of a tool that does not slide, too
  Vec3 acceleration = Vec3::Zero();  ///< of the hand [m/s^2]
};

/// From the contact point [m]; `normal` is that of the surface. Of a tool that slides, where it then is and half-way; of one that
/// rests, two directions across each other, a quarter as far as a hand that speeds up gets: further is less likely than it is
/// worth. Where its acceleration takes a tool elsewhere than its velocity does, there too.
std::vector<Vec3> expected_slides(const Vec3& velocity, const Vec3& normal, const ExpectedSlide& slide);

}  // namespace palpate
