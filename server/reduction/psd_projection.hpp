// Makes a grasp's patch passive where the body is not: a compressed body may push the tool in the direction of its motion.
//
// With t the tool's displacement [m] times the root of its node's mass m, and q the r modes, the elastic energy is 1/2 y^T J y,
//     y = (t, q),   J = [ K_p / m, -b_k^T / sqrt(m) ; -b_k / sqrt(m), diag(k) ]     (3 + r) x (3 + r) [1/s^2]
// J = U diag(l) U^T is replaced by its nearest positive semidefinite matrix in the Frobenius norm, U diag(max(l, 0)) U^T, and the
// modes are rotated so that their block is diagonal again. D, inputs, loads and branches are rotated with them.
//
// Cost: directions in which the body is about to buckle feel slack until E2 (nonlinear_terms.hpp) restores their stiffness.
// Source: Higham, Linear Algebra Appl. 103 (1988).
#pragma once

#include "common/patch/patch.hpp"
#include "server/solve/block_matrix.hpp"

namespace palpate {

/// Removes the negative eigenvalues of J (from joint_stiffness()); a patch that has none is unchanged. Returns minus the lowest
/// eigenvalue [1/s^2], 0 if none was negative. Values that are not finite are left to check(). `rotation`, if not null, becomes U
/// of the new modes q = U q~, r x r: the identity if none was negative.
double project_grasp(Patch& patch, double node_mass_kg, Eigen::MatrixXd* rotation = nullptr);

}  // namespace palpate
