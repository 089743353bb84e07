// How much too stiff a body of linear tetrahedra is expected to be where it bends.
//
// With n edges, of mean length, over the thinnest side of its box, and r = 2 nu / (1 - 2 nu), lambda over mu of the material that
// is least compressible,
//
//     stiffness / that of the continuum - 1 = (2.1 + 0.55 r) / n^2
//
// fitted to bars of tetrahedra that hang in gravity, two to eight cells high, nu = 0.3 to 0.49, against quadratic elements
// (docs/decisions/0064-hexahedra-with-one-mean-gradient.md); an upper bound where it is beyond 2.
#pragma once

#include "server/scene/scene.hpp"

namespace palpate {

/// 0 for a body without tetrahedra.
double expected_locking(const LumpedBody& body);

}  // namespace palpate
