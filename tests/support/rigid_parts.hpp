// Rigid parts without a scene file.
#pragma once

#include "server/scene/parts.hpp"

namespace palpate::test {

/// A box between two corners.
inline std::shared_ptr<const RigidPart> rigid_box(const Vec3& low, const Vec3& high, double friction) {
  std::vector<Vec3> corners;
  for (int n = 0; n < 8; ++n)
    corners.emplace_back(n & 1 ? high.x() : low.x(), n & 2 ? high.y() : low.y(), n & 4 ? high.z() : low.z());
  RigidPart part = make_part(std::move(corners),
                             {{0, 2, 3},
                              {0, 3, 1},
                              {4, 5, 7},
                              {4, 7, 6},
                              {0, 1, 5},
                              {0, 5, 4},
                              {2, 6, 7},
                              {2, 7, 3},
                              {0, 4, 6},
                              {0, 6, 2},
                              {1, 3, 7},
                              {1, 7, 5}},
                             Mat3::Identity());
  part.name = "box";
  part.friction = friction;
  part.stiffness_ratio = 4;
  return std::make_shared<const RigidPart>(std::move(part));
}

}  // namespace palpate::test
