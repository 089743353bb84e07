// How stiff a body is under a finger: the static stiffness at one place of it, as it hangs still,
//
//     k = 1 / (n^T B^T K^-1 B n)   [N/m]
//
// n the direction of the push, K the tangent stiffness of the free nodes, B the weights with which a force at that place acts on
// them (skin.hpp: the contact radius of the scene's tool is in them). What the contact itself gives way (`tool.coupling_n_m`)
// comes on top.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

struct FingerStiffness {
  Vec3 place = Vec3::Zero();     ///< [m]
  Vec3 outward = Vec3::UnitZ();  ///< unit normal there; of a grasped node z, of a sheet's y
  double stiffness_n_m = 0;
};

/// Where a tool at `tool` is nearest to the surface; of a scene with `attach` at its node. Nothing where no node is held fast, or
/// where the body has no stiffness to speak of.
std::optional<FingerStiffness> finger_stiffness(const Scene& scene, const Vec3& tool);
/// The same of several places, one each or none at all.
std::vector<FingerStiffness> finger_stiffnesses(const Scene& scene, std::span<const Vec3> tools);

}  // namespace palpate
