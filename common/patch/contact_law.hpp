// The contact law, the same code on both ends: the forces between a tool point and a deformable surface at the end of a tick
// (client) or of an integration stage (server).
//
// The material point under the tool would be at p_free at the end of the tick without contact, and moves by C lambda with a
// constant force lambda on the body. The tool, at h, is joined to it by the contact stiffness k_c (1/k_c = 0: rigid):
//
//     h - lambda / k_c = p_free + C lambda   =>   lambda = W^-1 (h - p_free),   W = C + I / k_c            (stick)
//     lambda . n >= 0 (n the outward normal), the tool would pull, and it is not inside, (h - p_free) . n >= 0
//                                                                                =>   lambda = 0            (release)
//     |lambda_t| > mu |lambda_n|, or it would pull and is inside: on the friction cone,  lambda = N (-n + mu t),  t the stick
//         force's tangent direction,  N from the normal row of W lambda = h - p_free;  the material point slips by
//         h - p_free - W lambda (tangential)
//
// C is symmetric positive semi-definite. All in frame W; lambda is the force on the body [N], lengths in m.
//
// Shapes: h, p_free, lambda, n, t 3, n and t of length 1; C, W 3 x 3 [m/N]; k_c [N/m]; N >= 0 [N]; mu >= 0, no unit.
// What can go wrong: with a rigid contact and a point without compliance W is singular, so 1/k_c = 0 counts as 1e-9 m/N. With
// strong friction and a C that couples normal and tangent the edge of the cone may not reach the surface: the force without
// friction is used, or a tool that is not inside is released. The three cases are tried in this order, not solved as one
// complementarity problem.
// Source: Signorini's and Coulomb's laws over the compliance of a deformable body, Duriez, Dubois, Kheddar and Andriot, IEEE
// TVCG 12 (2006).
#pragma once

#include "common/base/types.hpp"

namespace palpate {

struct ContactParameters {
  double contact_stiffness_n_m = 0;  ///< k_c, 0 = rigid
  double friction = 0;               ///< mu
  bool operator==(const ContactParameters&) const = default;
};

struct ContactClosure {
  bool touching = false;
  bool slipping = false;
  Vec3 lambda = Vec3::Zero();  ///< force on the body [N]
  Vec3 slip = Vec3::Zero();    ///< displacement of the material point along the surface by slip [m]
};

/// Point and normal are those of the end of the tick or stage, too: a contact that slips by more than kSlipToleranceM is closed
/// again at the new point, at most kSlidesMax times. Closed at the first point, its normal would be a tick old, an error of first
/// order in the tick (docs/notebook.md, 37).
inline constexpr double kSlipToleranceM = 1e-6;  ///< a tenth of the 0.01 mm to which a hand can be held steady
inline constexpr int kSlidesMax = 3;             ///< bounds the cost of a tick; a smaller one is faster, with a less exact normal

ContactClosure close_contact(const Vec3& p_free, const Mat3& compliance, const Vec3& normal, const Vec3& tool,
                             const ContactParameters& parameters) noexcept;

}  // namespace palpate
