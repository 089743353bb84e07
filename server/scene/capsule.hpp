// A capsule as a membrane on the surface of a solid: a triangle of it on every triangle of the surface, its nodes the solid's.
//
// It has no mass of its own, no stress at rest, and does not bend (tetra_kernel.hpp). Not where all three nodes are fixed.
#pragma once

#include "server/scene/settings.hpp"

namespace palpate {

/// Of a body that has its solid and its surface.
void add_capsule(LumpedBody& body, const CapsuleSettings& capsule);

}  // namespace palpate
