// Few finite elements whose forces stand for those of all of a solid and its membrane: the terms of a patch for finite elements
// (sampled_tetrahedra.hpp), of hexahedra as tetrahedra of the same gradient (sample_places.hpp).
//
// r_e(u) = -V_e H_e^T Q_e(H_e u), Q the stress beyond the linear one (nonlinear_tetrahedron.hpp), is what tetrahedron e adds to
// the linear force on the variables (sampling.hpp); candidates are the kCandidatesMax with the largest part in the samples.
//
// Source: see sampled_springs.hpp.
#pragma once

#include <optional>

#include "common/port/sampled_tetrahedra.hpp"
#include "server/reduce/basis.hpp"
#include "server/reduce/sampling.hpp"

namespace palpate {

/// `moved`: how the body moves with each variable, 3 N x n. For a solid of one law, with a membrane or without; nothing where
/// none of it is nonlinear.
std::optional<SampledTetrahedra> sample_tetrahedra(const WholeBody& body, const Matrix& moved, const Sampling& sampling);

}  // namespace palpate
