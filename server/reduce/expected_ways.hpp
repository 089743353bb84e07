// Where a hand may go while a patch lasts, from how it goes and how hands speed up: at most kHandMs2, and kFarthestM by that.
#pragma once

#include <vector>

#include "server/body/integrator.hpp"

namespace palpate {

inline constexpr double kHandMs2 = 0.4;  ///< how much a hand speeds up that explores

/// How far a hand gets from rest that speeds up [m], and how fast it then is [m/s].
double sped_up(double time_s);
double speed_of_speeding_up(double time_s);
/// How far a hand gets beside where its velocity takes it that speeds up for `speeds_up_s` and goes on [m]: a (t e - e^2 / 2),
/// e the shorter of both times.
Vec3 way_of_speeding_up(const Vec3& acceleration_m_s2, double time_s, double speeds_up_s);

/// How far the tool is likely to move along each axis in `bridge_s` [m].
Vec3 expected_motion(const ToolAt& tool, double bridge_s);

/// Ways of a hand that speeds up into the body while it goes on as it went [m].
std::vector<Vec3> expected_dents(const ToolAt& tool, const Vec3& inwards, double bridge_s);

/// Where on the surface a tool that touches may get to.
struct ExpectedSlide {
  double time_s = 0;                 ///< in this time; 0: nobody asks
  bool from_rest = false;            ///< ask of a tool that does not slide, too
  Vec3 acceleration = Vec3::Zero();  ///< of the hand [m/s^2]; for kSlideSpeedsUpS
};

/// For how long a hand that slides goes on to speed up, or slow down [s].
inline constexpr double kSlideSpeedsUpS = 0.1;

/// From the contact point [m]; `normal` is that of the surface. Of a tool that slides, where it then is and half-way; of one that
/// rests, two ways across each other, a quarter as far as a hand that speeds up gets: further is less likely than it is worth.
/// Where its acceleration takes a tool elsewhere than its velocity does, there too.
std::vector<Vec3> expected_slides(const Vec3& velocity, const Vec3& normal, const ExpectedSlide& slide);

}  // namespace palpate
