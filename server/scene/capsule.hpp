// A capsule as a membrane on the surface of a solid: one membrane triangle on every surface triangle, with the solid's nodes.
//
// It has no mass of its own, no stress at rest, and no bending stiffness (common/mechanics/membrane.hpp). Triangles whose three
// nodes are all fixed are omitted.
#pragma once

#include "server/scene/settings.hpp"

namespace palpate {

/// Adds the membrane to a body that already has its solid and its surface.
void add_capsule(LumpedBody& body, const CapsuleSettings& capsule);

}  // namespace palpate
