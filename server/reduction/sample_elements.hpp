// A few elements whose forces represent those of all elements of a body: the terms of a patch
// (common/patch/sampled_elements.hpp).
//
// r_e(u) = -H_e^T Q_e(H_e u), Q_e the force of element e beyond its linear one, is its contribution beyond the linear force on
// the variables (sampling.hpp):
//
//     springs          Q_e = f_e(d + G_e u) - f_e(d) - K_e G_e u,  f_e = T n     (sampled_springs.hpp)
//     finite elements  Q_e = V_e times the stress beyond the linear one          (common/mechanics/residual.hpp)
//
// with hexahedra as tetrahedra of the same gradient (gradient_points.hpp). Candidates are the elements with the largest
// contributions at the samples. Source: see sampled_springs.hpp.
#pragma once

#include <optional>

#include "common/patch/sampled_elements.hpp"
#include "server/reduction/basis.hpp"
#include "server/sampling/sampling.hpp"

namespace palpate {

/// `moved`: motion of the body with each variable, 3 N x n. For springs, or for finite elements of one law, with or without a
/// membrane. Returns none if no element is nonlinear, or if a spring has zero length.
std::optional<SampledElements> sample_elements(const WholeBody& body, const Matrix& moved, const Sampling& sampling);

}  // namespace palpate
