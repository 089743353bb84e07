// Prediction of a tool's motion while a patch lasts, from how its hand goes and how hands speed up: at most kHandMs2, and
// kAcceleratedMostM by that.
#pragma once

#include <vector>

#include "server/body/integrator.hpp"

namespace palpate {

inline constexpr double kHandMs2 = 0.4;  ///< how much a hand speeds up that explores

/// How far a hand gets from rest that speeds up [m], and how fast it then is [m/s].
double accelerated_distance(double time_s);
double accelerated_speed(double time_s);
/// How far a hand gets beside where its velocity takes it that speeds up for `acceleration_s` and goes on [m]: a (t e - e^2 / 2),
/// e the shorter of both times.
Vec3 accelerated_displacement(const Vec3& acceleration_m_s2, double time_s, double acceleration_s);

/// How far the tool is likely to move along each axis in `horizon_s` [m].
Vec3 expected_motion(const ToolAt& tool, double horizon_s);

/// Displacements of a hand that speeds up into the body while its velocity is dead-reckoned [m].
std::vector<Vec3> expected_indentations(const ToolAt& tool, const Vec3& inwards, double horizon_s);

/// Where on the surface a tool that touches may get to.
struct ExpectedSlide {
  double time_s = 0;                 ///< in this time; 0: nobody asks
  bool from_rest = false;            ///< ask of a tool that does not slide, too
  Vec3 acceleration = Vec3::Zero();  ///< of the hand [m/s^2]; for kSlideAccelerationS
};

/// For how long a hand that slides goes on to speed up, or slow down [s].
inline constexpr double kSlideAccelerationS = 0.1;

/// From the contact point [m]; `normal` is that of the surface. Of a tool that slides, where it then is and half-way; of one that
/// rests, two directions across each other, a quarter as far as a hand that speeds up gets: further is less likely than it is
/// worth. Where its acceleration takes a tool elsewhere than its velocity does, there too.
std::vector<Vec3> expected_slides(const Vec3& velocity, const Vec3& normal, const ExpectedSlide& slide);

}  // namespace palpate
