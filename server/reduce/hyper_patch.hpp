// The terms that go with a linear patch: which of the body's elements travel, what they are fitted to, and the repair of a
// stiffness that was projected.
//
// The variables u of the patch (nonlinear_terms.hpp) move the body by W u, W = (how it moves with the tool, V). Elements are
// chosen and weighted (sampling.hpp) for displacements u that the body is likely to come to: the candidates that the basis was
// made of (hyper_basis.hpp), V^T M w, each as large as it is likely to become; how far the tool is likely to move along each
// axis; where the body was in the last frames, where it rests, and where it will be as its hands may move on. Some samples lie on
// and around indentations that a hand is likely to make, or where a grasped body will be. For a tool that touches, springs'
// dampers are left out where the modes brake away more than exp(-kMostBraked) of what moves within a step: what dampers push for
// having turned is a step old when the player takes it. A grasp knows at once how the tool moves its node. PSD projection makes a
// patch passive (psd_projection.hpp); with H and H~ the joint stiffness before and after, terms give that back,
//     E2 = 1/2 u^T (H - H~) u.
#pragma once

#include <optional>

#include "common/port/nonlinear_terms.hpp"
#include "common/port/patch.hpp"
#include "server/reduce/basis.hpp"

namespace palpate {

struct HyperShapes {
  Matrix port;           ///< how the body moves for d_i = a_i with all modes at zero, 3 N x 3; no columns for touch
  Vec3 amplitude;        ///< a_i [m]; of a grasp
  Matrix modes;          ///< V, of the patch
  Matrix coordinates;    ///< V^T M w, of the candidates
  int indentations = 0;  ///< of its columns, the last
  Matrix psd_change;     ///< H - H~
  Matrix snapshots;      ///< u of where the body was, rests and will be, a column each
  int ahead = 0;         ///< of its columns, the last: where it will be
  int going_on = 0;      ///< of these, the first: as hands go on by themselves
};

/// Springs or tetrahedra of the body (sample_springs.hpp, sample_tetrahedra.hpp), as many as fit beside a surface of which so
/// many vertices are in the patch. Nothing where none bends, or where they would not be stable. For a body that can_bend().
std::optional<NonlinearTerms> nonlinear_terms(const Linearisation& at, const Patch& patch, const HyperShapes& shapes,
                                              int vertices);

}  // namespace palpate
