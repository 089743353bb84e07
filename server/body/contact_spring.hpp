// A spring, a damper and Coulomb friction between a point and the surface that it is inside of.
//
// The point is at depth d; g = grad phi, n = g / |g|, P = 1 - n n^T; v its velocity and o its way from the anchor, both relative
// to what it touches:
//
//     normal        N g,   N = max(0, k d - c g . v min(1, d / d_0))
//     friction      T = -H cut to |T| <= mu N |g|,   H = k P o + c P v
//     anchor        where contact begins; after each step it moves so that |k P o| <= mu N |g|
//
// d_0 lets the damper begin without a step. The tangents are K = k g g^T + k P where it sticks, and with
// (mu N |g| / |H|) k (P - s s^T), s = H / |H|, instead of k P where it slips; D likewise, with c min(1, d / d_0) g g^T and c. The
// part of the tangent of a slip that is not symmetric is left out.
//
// Shapes: v, o, g, n, T 3; K, D 3 x 3; all in frame W. Units: d, d_0, o m; k N/m; c N s/m.
// Source: penalty contact with a return map for friction, Wriggers, Computational Contact Mechanics (2006), 5.2 and 6.3.
#pragma once

#include <optional>

#include "common/base/types.hpp"

namespace palpate {

struct ContactSpring {
  double stiffness_n_m = 0, damping_n_s_m = 0, friction = 0, onset_m = 0;
};

struct ContactTouch {
  Vec3 force = Vec3::Zero();
  Vec3 kept = Vec3::Zero();  ///< way from the anchor that is left at the end of a step
  Mat3 stiffness = Mat3::Zero(), damping = Mat3::Zero();
  double energy_j = 0;  ///< of the springs
};

/// Returns the force on a point at a depth > 0, and its tangents; `offset`: none where contact begins. Nothing is returned where
/// g has no direction, as in the middle of a solid.
std::optional<ContactTouch> touch_of(const ContactSpring& spring, double depth_m, const Vec3& g, const Vec3& v,
                                     const std::optional<Vec3>& offset);

}  // namespace palpate
