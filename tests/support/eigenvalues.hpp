// Eigenvalues of small dense matrices, compiled once: each unit that has Eigen's solvers inline takes the compiler seconds
// longer.
#pragma once

#include <Eigen/Core>

namespace palpate::test {

/// Returns the eigenvalues of a symmetric matrix, ascending.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& a);
/// Returns the l of a y = l b y, ascending; a symmetric, b symmetric and positive definite.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace palpate::test
