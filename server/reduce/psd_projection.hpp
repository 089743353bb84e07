// Makes a grasp's patch passive where the body is not: a compressed body may push the tool the way it already goes.
//
// With t the tool's displacement [m] times the root of its node's mass m, and q the r modes, the elastic energy is 1/2 y^T J y,
//     y = (t, q),   J = [ K_p / m, -b_k^T / sqrt(m) ; -b_k / sqrt(m), diag(k) ]     (3 + r) x (3 + r) [1/s^2]
// J = U diag(l) U^T is replaced by its nearest positive semidefinite matrix in the Frobenius norm, U diag(max(l, 0)) U^T, and the
// modes are turned so that their block is diagonal again. D, inputs, loads and branches turn with them.
//
// What it costs: directions in which the body is about to buckle are felt as slack until E2 (nonlinear_terms.hpp) gives back what
// was taken. Source: Higham, Linear Algebra Appl. 103 (1988).
#pragma once

#include "common/port/patch.hpp"
#include "server/body/block_matrix.hpp"

namespace palpate {

/// J (from joint_stiffness()) loses its negative eigenvalues; a patch that has none is left as it is. Returns minus the lowest
/// eigenvalue [1/s^2], 0 when none was negative. Numbers that are not finite are left to check(). `rotation`, when wanted, is U
/// of the new modes q = U q~, r x r: the identity when nothing was negative.
double project_grasp(Patch& patch, double node_mass_kg, Eigen::MatrixXd* rotation = nullptr);

}  // namespace palpate
