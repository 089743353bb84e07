// A few finite elements whose forces represent those of all elements of a solid and its membrane: the terms of a patch for finite
// elements (sampled_tetrahedra.hpp), with hexahedra as tetrahedra of the same gradient (gradient_points.hpp).
//
// r_e(u) = -V_e H_e^T Q_e(H_e u), Q the stress beyond the linear one (nonlinear_tetrahedron.hpp), is the contribution of
// tetrahedron e beyond the linear force on the variables (sampling.hpp); candidates are the kCandidatesMax with the largest
// contributions at the samples.
//
// Source: see sampled_springs.hpp.
#pragma once

#include <optional>

#include "common/port/sampled_tetrahedra.hpp"
#include "server/reduce/basis.hpp"
#include "server/reduce/sampling.hpp"

namespace palpate {

/// `moved`: motion of the body with each variable, 3 N x n. For a solid of one law, with or without a membrane. Returns none if
/// no element is nonlinear.
std::optional<SampledTetrahedra> sample_tetrahedra(const WholeBody& body, const Matrix& moved, const Sampling& sampling);

}  // namespace palpate
