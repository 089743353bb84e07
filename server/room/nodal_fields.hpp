// Scalars at the nodes of a body, for viewers that request them.
#pragma once

#include <span>
#include <vector>

#include "common/patch/patch.hpp"
#include "common/wire/shape_blocks.hpp"
#include "server/body/dynamics.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// Returns at each node the largest |T(e)| of its springs [N], without dampers. x: node positions.
std::vector<float> element_tension(const LumpedBody& body, const Vector& x);

/// Returns a field at each node, from its finite elements of nonzero volume, with the Cauchy stress sigma = (P - F Z) F^T / J
/// without dampers (J not below kVolumeRatioLeast; Z the relaxed part of the second Piola-Kirchhoff stress, relaxation.hpp):
///     stress     the largest von Mises stress sqrt(3/2 s : s), s the deviator of sigma [Pa]
///     strain     the largest |principal stretch - 1|
///     pressure   the volume-weighted mean of -tr(sigma) / 3 [Pa]
///     tension    element_tension()
/// Without finite elements all but the tension is zero.
std::vector<float> nodal_field(const Dynamics& dynamics, const BodyState& state, ShapeChannel field);
inline constexpr double kVolumeRatioLeast = 0.1;  ///< lower bound of J: sigma of a flat element is unbounded

/// Adds to the values at nodes those at the other vertices: the means of their nodes', by weight.
std::vector<float> at_vertices(const LumpedBody& body, std::vector<float> of_nodes);

/// Raises `support` at the body's vertices that are in the patch's local surface: to 1 at the vertex that its modes move most,
/// elsewhere in proportion to the length of the port rows. `positions`: of all vertices in the frame of the patch.
void add_support(const Patch& patch, std::span<const Vec3> positions, std::vector<float>& support);

}  // namespace palpate
