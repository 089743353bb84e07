// Scalars over the nodes of a body, for viewers who ask to see them.
#pragma once

#include <span>
#include <vector>

#include "common/port/patch.hpp"
#include "common/wire/shape_blocks.hpp"
#include "server/body/dynamics.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// At each node the largest |T(e)| of the elements that it joins [N], dampers left out. x: node positions.
std::vector<float> element_tension(const LumpedBody& body, const Vector& x);

/// Of the finite elements at each node that have a volume, with the Cauchy stress sigma = (P - F Z) F^T / J, dampers left out (J
/// not below kVolumeRatioLeast; Z what has faded of the second Piola-Kirchhoff stress, relaxation.hpp):
///     stress     the largest von Mises stress sqrt(3/2 s : s), s the deviator of sigma [Pa]
///     strain     the largest |principal stretch - 1|
///     pressure   the mean of -tr(sigma) / 3, by volumes [Pa]
/// zeros for a body of springs; or element_tension().
std::vector<float> nodal_field(const Dynamics& dynamics, const BodyState& state, ShapeChannel field);
inline constexpr double kVolumeRatioLeast = 0.1;  ///< a smaller J counts as this: of a flat element sigma has no bound

/// Raises `support` where a patch with a local surface carries a vertex of the body: to 1 at the vertex that its modes move most,
/// elsewhere in proportion to the length of the port rows. `positions` of all vertices are those of the frame of the patch.
void add_support(const Patch& patch, std::span<const Vec3> positions, std::vector<float>& support);

}  // namespace palpate
