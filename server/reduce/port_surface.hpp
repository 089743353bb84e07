// The piece of surface that travels with a touch patch: triangles around the contact point, ring by ring, as many as fit.
#pragma once

#include "server/body/dynamics.hpp"
#include "server/body/skin.hpp"

namespace palpate {

/// Fills patch.surface and patch.point. `v` is the patch's basis (3 N x r); vertex i of the piece gets its position and its rows
/// of v.
void cut_port_surface(const Skin& skin, const BodyState& state, const Matrix& v, const SurfacePoint& point,
                      int vertices_max, Patch& patch);

}  // namespace palpate
