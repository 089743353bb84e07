// Decompositions of a deformation gradient F (3 x 3, no unit), in double precision, one at a time; in lanes: polar_lanes.hpp.
//
//     cofactors           G = dJ/dF,  J = det F;   G = J F^-T where J is not 0
//     singular values     F = U diag(s) V^T,  det U = det V = 1,  s_1 >= s_2 >= |s_3|,  s_3 with the sign of J
//     polar rotation      F = R S,  S = S^T,  R = U V^T: the rotation with the largest tr(R^T F)
//                         by Newton's method R <- (c R + R^-T / c) / 2,  c^2 = |R^-T| / |R|,  from R = F
//                         where F is well formed, J 3^1.5 > 0.1 |F|^3; elsewhere, flat or inside out, from U and V
//
// What can go wrong: where s_2 + s_3 = 0 R is not unique, and near it R flips with small changes of F, so that its derivative,
// which is proportional to 1 / (s_i + s_j), has to be limited (kLeastPairSum).
// Source: Higham, Computing the polar decomposition, SIAM J. Sci. Stat. Comput. 7 (1986).
#pragma once

#include <Eigen/Core>

namespace palpate {

/// Lower limit of the sum of two principal stretches, 2 at rest: the rotation flips where the sum vanishes, and the corotational
/// tangent is limited here, where the part due to rotation is 40 times that at rest.
inline constexpr double kLeastPairSum = 0.05;

/// Returns dJ/dF, J = det F.
Eigen::Matrix3d cofactors(const Eigen::Matrix3d& f);

struct SignedSvd {  ///< F = u diag(s) v^T with rotations u, v; s.z() carries the sign of det F
  Eigen::Matrix3d u, v;
  Eigen::Vector3d s;
};
SignedSvd signed_svd(const Eigen::Matrix3d& f);

/// Returns the rotation nearest to F: F = R S with S symmetric, det R = 1. Where F is inside out the smallest eigenvalue of S is
/// negative.
Eigen::Matrix3d polar_rotation(const Eigen::Matrix3d& f);

}  // namespace palpate
