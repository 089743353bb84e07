// A box as a closed surface.
#pragma once

#include "common/patch/triangle_tree.hpp"

namespace palpate::test {

/// A box between two corners, counter-clockwise seen from outside.
inline TriangleMesh box_mesh(const Vec3& low, const Vec3& high) {
  TriangleMesh mesh;
  for (unsigned n = 0; n < 8; ++n)
    mesh.vertices.emplace_back(n & 1U ? high.x() : low.x(), n & 2U ? high.y() : low.y(), n & 4U ? high.z() : low.z());
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

}  // namespace palpate::test
