// Compliances by which lattices of several spacings are compared with each other: of the same places, pushed in the same
// directions.
//
//     C = n^T B^T K^-1 B n   [m/N]
//
// K is the tangent stiffness of the free nodes in the body's equilibrium, B the weights of a force at the place
// (server/body/skin.hpp, with the tool's contact radius), n the outward normal. At an edge the normals of two lattices differ
// by up to a right angle, and beside the support C depends on the height at which each lattice happens to have its last held
// nodes. Places and normals are therefore those of one lattice, and the places have the tip's radius between them and the
// support.
#pragma once

#include <span>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// A place of a surface and the outward unit normal there.
struct PushedPlace {
  Vec3 place = Vec3::Zero(), outward = Vec3::UnitZ();  ///< [m]
};

/// Returns up to `count` places of the scene's body that are far from each other, the nearest to `first` first: `radius_m` or
/// more above `held_below_m`, or in the upper half of what is free where that is less.
std::vector<PushedPlace> compared_places(const Scene& scene, double held_below_m, const Vec3& first, std::size_t count);

/// Returns C at the points of the body that are nearest to `places`, one entry each; an empty vector if the held nodes leave the
/// body without an equilibrium.
std::vector<double> touch_compliances(const Scene& scene, std::span<const PushedPlace> places);

}  // namespace palpate
