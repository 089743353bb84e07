// The part of a symmetric 3x3 matrix above a bound.
#pragma once

#include <Eigen/Eigenvalues>

#include "common/base/types.hpp"

namespace palpate {

/// Returns sum_i max(0, mu_i - least) w_i w_i^T with mu_i, w_i the eigenvalues and vectors of `symmetric`. No allocation.
inline Mat3 part_above(const Mat3& symmetric, double least) noexcept {
  const Mat3 below = least * Mat3::Identity() - symmetric;
  const bool nothing = below(0, 0) > 0 && below(0, 0) * below(1, 1) > below(0, 1) * below(1, 0) && below.determinant() > 0;
  if (nothing) return Mat3::Zero();  // cheaper than the eigenvalues
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(symmetric);
  const Mat3& directions = eigen.eigenvectors();
  return directions * (eigen.eigenvalues().array() - least).cwiseMax(0).matrix().asDiagonal() * directions.transpose();
}

}  // namespace palpate
