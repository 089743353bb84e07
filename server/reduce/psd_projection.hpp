// Makes a grasp's patch passive where the body is not: a compressed body may push the tool the way it already goes.
#pragma once

#include "common/port/patch.hpp"
#include "server/body/block_matrix.hpp"

namespace palpate {

/// joint_stiffness() with the tool's axes scaled by the square root of its
/// node's mass, loses its negative eigenvalues (PSD projection); the modes are turned so that K is diagonal again. A patch that
/// has none is left as it is. Returns minus the lowest eigenvalue [1/s^2], 0 when none was negative. Numbers that are not finite
/// are left to check(). `rotation`, when wanted, is U of the new modes q = U q~: the identity when nothing was negative.
double project_grasp(Patch& patch, double node_mass_kg, Eigen::MatrixXd* rotation = nullptr);

}  // namespace palpate
