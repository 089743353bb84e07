// Static stiffness of a body under a finger, at one place, in its equilibrium under gravity,
//
//     k = 1 / (n^T B^T K^-1 B n)   [N/m]
//
// n the direction of the push, K the tangent stiffness of the free nodes, B the weights with which a force at that place acts on
// them (skin.hpp; they include the contact radius of the scene's tool). The compliance of the contact itself
// (`tool.contact_stiffness_n_m`) is not included.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

struct SurfaceStiffness {
  Vec3 place = Vec3::Zero();     ///< [m]
  Vec3 outward = Vec3::UnitZ();  ///< unit normal there; z for a grasped node, y for that of a sheet
  double stiffness_n_m = 0;
};

/// Returns the stiffness at the point of the surface nearest to `tool`; for a scene with `attach` at its node. Returns none if no
/// node is fixed, or if the body has no significant stiffness.
std::optional<SurfaceStiffness> finger_stiffness(const Scene& scene, const Vec3& tool);
/// Returns the same at several places: one entry each, or an empty vector. `outward`: unit vectors against which the finger
/// pushes, one for each place, instead of the surface's own normals.
std::vector<SurfaceStiffness> finger_stiffnesses(const Scene& scene, std::span<const Vec3> tools,
                                                 std::span<const Vec3> outward = {});

}  // namespace palpate
