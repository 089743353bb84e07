// Few springs that bend as all of a body do: the terms of a patch where no polynomial follows it (sampled_springs.hpp).
//
// For displacements u_s that are likely to come, with r_e(u) = G_e^T (f_e(d + G_e u) - f_e(d) - K_e G_e u) what spring e adds to
// the linear force on the variables, weights w_e >= 0, few of them not zero, are sought for which
//
//     sum_s | sum_e w_e r_e(u_s) - sum_(all e) r_e(u_s) |^2 / g_s^2       is small, g_s = |sum r_e(u_s)| + kOfLinear |K u_s|
//
// forces in units that make the stiffness of each variable 1. A greedy non-negative least squares (sparse_weights.hpp), springs
// between nodes that travel anyway being cheap: candidates are the kCandidates springs with the largest part in the samples, and
// weights are found once more for the nodes' motions as they travel. As no w_e is negative, what is sent stiffens and buckles as
// springs do, and stores energy as they do beyond its second order at the stamp.
//
// Samples are the answers that a patch's basis was made of, alone, doubled, back, and mixed by chance, the same in every run;
// where dents are known that a hand is likely to make, half of them lie on and around these.
//
// Source: see sampled_springs.hpp.
#pragma once

#include <optional>

#include "common/port/sampled_springs.hpp"
#include "common/port/terms_pieces.hpp"
#include "server/reduce/basis.hpp"

namespace palpate {

inline constexpr double kOfLinear = 0.1;  ///< an error that small beside the linear force is felt by nobody

struct SpringSampling {
  Matrix likely;     ///< u of answers of the body, each as large as it is likely to become, a column each
  Matrix path;       ///< u of dents on the way of a hand that goes on; may have no columns
  Vector stiffness;  ///< of each variable, > 0
  TermsRoom room;    ///< that springs have
  int tool = -1;     ///< the node that a tool holds; the first three variables are how it moves
};

/// `moved`: how the body moves with each variable, 3 N x n. Nothing where no spring bends, or one has no length.
std::optional<SampledSprings> sample_springs(const Linearisation& at, const Matrix& moved, const SpringSampling& sampling);

}  // namespace palpate
