// Estimate of how much too stiff a body of linear tetrahedra is in bending.
//
// With n edges of mean length over the thinnest side of its bounding box, and r = 2 nu / (1 - 2 nu), lambda over mu of the least
// compressible material,
//
//     stiffness / that of the continuum - 1 = (2.1 + 0.55 r) / n^2
//
// fitted to bars of tetrahedra that hang under gravity, two to eight cells high, nu = 0.3 to 0.49, against quadratic elements
// (docs/decisions/0064-hexahedra-with-one-mean-gradient.md); an upper bound where it is above 2.
#pragma once

#include "server/scene/scene.hpp"

namespace palpate {

/// Returns the excess stiffness as a share, 0 for a body without tetrahedra.
double expected_locking(const LumpedBody& body);

}  // namespace palpate
