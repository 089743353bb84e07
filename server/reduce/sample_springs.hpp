// Few springs whose forces stand for those of all of a body: the terms of a patch of a lattice (sampled_springs.hpp).
//
// r_e(u) = G_e^T (f_e(d + G_e u) - f_e(d) - K_e G_e u), f_e = T n, is minus what spring e adds to the linear force on the
// variables (sampling.hpp, where the sign cancels); candidates are the kCandidatesMax springs with the largest part in the
// samples.
//
// Source: see sampled_springs.hpp.
#pragma once

#include <optional>

#include "common/port/sampled_springs.hpp"
#include "server/reduce/basis.hpp"
#include "server/reduce/sampling.hpp"

namespace palpate {

/// `moved`: how the body moves with each variable, 3 N x n. Nothing where no spring is nonlinear, or one has no length.
std::optional<SampledSprings> sample_springs(const WholeBody& body, const Matrix& moved, const Sampling& sampling);

}  // namespace palpate
