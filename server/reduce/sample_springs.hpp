// A few springs whose forces represent those of all springs of a body: the terms of a patch of a lattice (sampled_springs.hpp).
//
// r_e(u) = G_e^T (f_e(d + G_e u) - f_e(d) - K_e G_e u), f_e = T n, is minus the contribution of spring e beyond the linear force
// on the variables (sampling.hpp, where the sign cancels); candidates are the kCandidatesMax springs with the largest
// contributions at the samples.
//
// Source: see sampled_springs.hpp.
#pragma once

#include <optional>

#include "common/port/sampled_springs.hpp"
#include "server/reduce/basis.hpp"
#include "server/reduce/sampling.hpp"

namespace palpate {

/// `moved`: motion of the body with each variable, 3 N x n. Returns none if no spring is nonlinear, or if one has zero length.
std::optional<SampledSprings> sample_springs(const WholeBody& body, const Matrix& moved, const Sampling& sampling);

}  // namespace palpate
