// Rigid parts without a scene file.
#pragma once

#include "server/scene/parts.hpp"
#include "tests/support/box_mesh.hpp"

namespace palpate::test {

/// A box between two corners.
inline std::shared_ptr<const RigidPart> rigid_box(const Vec3& low, const Vec3& high, double friction) {
  TriangleMesh mesh = box_mesh(low, high);
  RigidPart part = make_part(std::move(mesh.vertices), std::move(mesh.triangles), Mat3::Identity());
  part.name = "box";
  part.friction = friction;
  part.stiffness_ratio = 4;
  return std::make_shared<const RigidPart>(std::move(part));
}

}  // namespace palpate::test
