// The upper side of a body: the part of its surface that is seen from above.
#pragma once

#include <optional>

#include "server/scene/scene.hpp"

namespace palpate {

/// Returns the scene with its nodes in their equilibrium under gravity. Throws what settled_state() throws.
Scene as_it_hangs(Scene scene);
/// Height of the upper side over a point of the plane z = 0; empty if there is no face.
std::optional<double> height_above(const LumpedBody& body, double x, double y);
/// Point of the upper side at which a tool that comes down from `home` meets it. Where there is no face (a ring, two bodies), it
/// is the centre of the nearest face that is not steep; `home` if there is none.
Vec3 place_below(const LumpedBody& body, const Vec3& home);

}  // namespace palpate
