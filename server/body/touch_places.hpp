// Places of a body's surface where a hand may come, far from each other: its lobes, edges and middle.
#pragma once

#include "server/scene/scene.hpp"

namespace palpate {

/// The middle of the free triangle nearest to `first`, and then one by one the middle of that which is farthest from all before.
/// Triangles are free where none of their nodes is held. Fewer than `count`, at worst none, where there are no more.
std::vector<Vec3> touch_places(const LumpedBody& body, const Vec3& first, std::size_t count);

}  // namespace palpate
