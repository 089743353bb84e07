// A lump: a ball in which the body is stiffer, or softer, by a ratio; what a trainee looks for.
//
// Young's modulus of an element with the share s of its volume in the ball becomes
//
//     E (1 + s (ratio - 1)),   s = n / 64 over its 64 points (i + 1/2)/4, (j + 1/2)/4, (k + 1/2)/4 of a hexahedron, rounded to
//     1/16
//
// the upper (Voigt) bound of a mixture, so that stiffness depends smoothly on centre and radius although elements are larger. Of
// a tetrahedron the points are those of three regular cuts; a spring's stiffness and damping change by the share of its length.
// Law, Poisson's ratio, density and damping_s stay. Assumption: the lump is joined to what surrounds it.
#pragma once

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// Changes the elements of a body that has its elements and its surface, and no capsule yet. Throws InputError for a lump whose
/// centre is outside the body, and one that is too small to change any element.
void add_lump(LumpedBody& body, const LumpSettings& lump, const SceneText& text);

}  // namespace palpate
