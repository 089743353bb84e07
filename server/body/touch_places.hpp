// Points of a body's surface where a hand may come, far from each other: its lobes, edges and middle.
#pragma once

#include "server/scene/scene.hpp"

namespace palpate {

/// Returns the centre of the free triangle nearest to `first`, and then one by one the centre of the free triangle farthest from
/// all before. A triangle is free if none of its nodes is fixed. Returns fewer than `count` if there are fewer free triangles.
std::vector<Vec3> touch_places(const LumpedBody& body, const Vec3& first, std::size_t count);

}  // namespace palpate
