// How the stiffness of a block of elements changes with the number m of elements between its loaded face and its held end.
//
// A lattice has the same element everywhere, so the same block meshed more finely has more elements in series and more of them
// side by side. Seen from a loaded face of fixed size in elements, in a body that widens towards its end (a tool's
// neighbourhood), the elements lie in shells, j = 1 next to the face, each with a compliance w_d(j) relative to the first:
//
//     s_d(m) = 1 / W_d(m),      W_d(m) = sum_{j=1..m} w_d(j),      w_d(1) = 1,   w_d(j) = (c_d + a_d j)^-(d-1)   for j > 1
//
// d dimensions. In one, w = 1 and s = 1 / m: springs in series, exactly. In two, s falls like 1 / ln m, in three it tends to a
// constant: a force from a small face spreads, and the far shells hardly yield (Flamant's and Boussinesq's half planes and
// spaces). c_d and a_d are fitted to lattices that were measured (palpate-lab scaling; tests/paper repeats it): largest singular
// value of the stiffness of a rigid box of one layer of cells around a node in the middle of a free face, with all nodes m
// elements further out held. The fit is within 2 % of the lattices for m up to 16 (two dimensions) and 8 (three). Why this block
// and not the plate-loaded one, whose law is m^(d-2): docs/decisions/0010-two-layer.md. Source: Cavusoglu and Tendick,
// section 5.2 and fig. 16, which prints neither the block's loading nor figures.
#pragma once

#include <limits>

#include "server/scene/scene.hpp"

namespace palpate {

/// Elements to the end of a body that is held nowhere.
inline constexpr int kNoEnd = std::numeric_limits<int>::max();

/// W_d(m), dimension 1 to 3, m >= 0; infinite for kNoEnd.
double shell_compliance(int dimension, int elements_to_end);
/// s_d(m) = 1 / W_d(m), 0 for kNoEnd; m >= 1.
double block_scale(int dimension, int elements_to_end);
/// 1 when all elements of the body are parallel, 2 when they lie in parallel planes, else 3.
int dimension_of(const LumpedBody& body);

}  // namespace palpate
