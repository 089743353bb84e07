// 64 points of an element that stand for equal shares of its volume: (i + 1/2)/4, (j + 1/2)/4, (k + 1/2)/4 of a hexahedron, and
// of a tetrahedron the middles of the 64 that two regular cuts make.
#pragma once

#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

std::vector<Vec3> points_in(const Hexahedron& cell, const std::vector<Vec3>& x);
std::vector<Vec3> points_in(const Tetrahedron& cell, const std::vector<Vec3>& x);

}  // namespace palpate
