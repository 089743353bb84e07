// The terms that go with a linear patch: which of the body's elements travel, what they are weighted for, and the repair of a
// stiffness that was projected.
//
// The variables u of the patch (nonlinear_terms.hpp) move the body by W u, W = (how it moves with the tool, V); a snapshot w of
// it has u = (w at the tool's node, V^T M w). Elements are chosen and weighted (sampling.hpp) for the snapshots that the basis
// was made of (snapshot_set.hpp).
// For a tool that touches, springs' dampers are left out where the modes leave less than exp(-kBrakingPerStepMax) of a motion
// after a step: what dampers push for having turned is a step old when the player takes it. A grasp knows at once how the tool
// moves its node. PSD projection makes a patch passive (psd_projection.hpp); with H and H~ the joint stiffness before and after,
// terms give that back,
//     E2 = 1/2 u^T (H - H~) u.
//
// Shapes: N nodes of the body or of the nonlinear subdomain, r modes, n = r or, of a grasp, r + 3 variables; u n [m for the
// tool, m kg^1/2 for modes]; w 3 N [m]; V 3 N x r [kg^-1/2], W 3 N x n; H, H~ n x n [N/m for the tool, 1/s^2 for modes].
// What can go wrong: no weight is positive, or the elements are too stiff for the player's step: then there are no terms.
// Source: energy-conserving sampling and weighting, Farhat, Avery, Chapman and Cortial, IJNME 98 (2014).
#pragma once

#include <optional>
#include <vector>

#include "common/port/nonlinear_terms.hpp"
#include "common/port/patch.hpp"
#include "server/reduce/basis.hpp"
#include "server/reduce/snapshot_set.hpp"

namespace palpate {

struct HyperModel {
  Matrix port;        ///< how the body moves with the tool along each axis, all modes at zero, 3 N x 3; no columns for touch
  Matrix modes;       ///< V, of the patch
  Matrix psd_change;  ///< H - H~
  Matrix snapshots;   ///< u of each snapshot that the basis was made of, n x m
  std::vector<Eigen::Index> likeliest;  ///< of these
};

/// Springs or tetrahedra of the body (sample_springs.hpp, sample_tetrahedra.hpp), as many as fit beside a surface of which so
/// many vertices are in the patch. Nothing where none is nonlinear, or where they would not be stable. For a body that
/// has_nonlinear_elements().
std::optional<NonlinearTerms> nonlinear_terms(const WholeBody& body, const Patch& patch, const HyperModel& model, int vertices);

}  // namespace palpate
