// What a deformation gradient F is made of.
#pragma once

#include <Eigen/Core>

namespace palpate {

/// Of two principal stretches: the rotation turns over where it vanishes, and the corotational tangent is cut there.
inline constexpr double kLeastPairSum = 0.05;

/// dJ/dF, J = det F.
Eigen::Matrix3d cofactors(const Eigen::Matrix3d& f);

struct SignedSvd {  ///< F = u diag(s) v^T with rotations u, v; s.z() carries the sign of det F
  Eigen::Matrix3d u, v;
  Eigen::Vector3d s;
};
SignedSvd signed_svd(const Eigen::Matrix3d& f);

/// The rotation next to F: F = R S with S symmetric, det R = 1. Where F is inside out S has its smallest eigenvalue negative.
Eigen::Matrix3d polar_rotation(const Eigen::Matrix3d& f);

}  // namespace palpate
