// The terms of a patch: the elements of the body that are sent, the snapshots for which they are weighted, and the correction of
// a stiffness that was projected.
//
// The variables u of the patch (nonlinear_terms.hpp) move the body by W u, W = (its motion with the tool, V); a snapshot w of it
// has u = (w at the tool's node, V^T M w). Elements are chosen and weighted (sampling.hpp) for the snapshots from which the basis
// was made (snapshot_set.hpp). For a tool that touches, springs' dampers are left out if the modes keep less than
// exp(-kDampingPerStepMax) of a motion after a step: the player uses their force from rotation one step late. For a grasp the
// motion of the tool's node is known without delay. PSD projection makes a patch passive (psd_projection.hpp); with H and H~ the
// joint stiffness before and after, terms restore
//     E2 = 1/2 u^T (H - H~) u.
//
// Shapes: N nodes of the body or of the nonlinear subdomain, r modes, n = r variables, r + 3 for a grasp; u n [m for the tool,
// m kg^1/2 for modes]; w 3 N [m]; V 3 N x r [kg^-1/2], W 3 N x n; H, H~ n x n [N/m for the tool, 1/s^2 for modes].
// A solid's sampled elements may buckle in motions that no snapshot has, where the body does not. So its patch is played with
// its terms and without, F and F_l, while its tool is dead-reckoned over the horizon (tool_prediction.hpp); its terms depart if
// at some time
//     |F - F_l| > 2 |F_l| + 1 N.
//
// Failures: if no weight is positive, or the elements are too stiff for the player's step, there are no terms.
// Source: energy-conserving sampling and weighting, Farhat, Avery, Chapman and Cortial, IJNME 98 (2014).
#pragma once

#include <optional>
#include <vector>

#include "common/patch/nonlinear_terms.hpp"
#include "common/patch/patch.hpp"
#include "server/reduction/basis.hpp"
#include "server/reduction/snapshot_set.hpp"

namespace palpate {

struct HyperModel {
  Matrix port;        ///< motion of the body with the tool along each axis at zero modes, 3 N x 3; no columns for touch
  Matrix modes;       ///< V of the patch
  Matrix psd_change;  ///< H - H~
  Matrix snapshots;   ///< u of each snapshot of the basis, n x m
  std::vector<Eigen::Index> likeliest;  ///< columns of `snapshots`
};

/// Returns springs or finite elements of the body (sample_elements.hpp), as many as fit with a surface that has
/// `vertices` vertices in the patch. Returns none if none is nonlinear, or if they would be unstable. Requires a body that
/// has_nonlinear_elements().
std::optional<NonlinearTerms> nonlinear_terms(const WholeBody& body, const Patch& patch, const HyperModel& model, int vertices);

/// Returns true if the terms of a patch depart where its tool, held as it is, moves on.
bool terms_depart(const Patch& patch, const NonlinearTerms& terms, Micros horizon);

}  // namespace palpate
