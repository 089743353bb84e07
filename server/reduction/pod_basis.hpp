// The basis of a nonlinear patch: proper orthogonal decomposition of snapshots (snapshot_set.hpp) in the energy of
// P = s^2 M + s D + K.
//
//     W = (alpha_k w_k), rows of held nodes zero;   W^T P W = U Lambda U^T;   V = leading columns of W U Lambda^-1/2, made
//                                                                             orthonormal in M
//
// so V spans the likely motions of the body over a time of 1 / s, by energy. In addition to the leading directions it includes
// some that have little energy and act fast, unless those span them: for a touch M^-1 B n, the first response of the body along
// the normal n, which matters for an onset (3 to 8 dB with little damping, docs/notebook.md, 20); of jaws the responses to their
// contacts pushing together (2 to 8 dB at 150 ms, docs/decisions/0080-jaws.md).
//
// Shapes: N coordinates of three numbers (body_operator.hpp), m snapshots, r modes; V is 3 N x r [kg^-1/2]. There are fewer modes
// than requested if snapshots are dependent to kEnergyRounding of the largest energy, or P is not positive along them (a body in
// a fold), and none if nothing moves.
//
// Sources: Sirovich, Quart. Appl. Math. 45 (1987), for the method of snapshots; Rathinam and Petzold, SIAM J. Numer. Anal. 41
// (2003), for the weight.
#pragma once

#include <span>

#include "server/reduction/basis.hpp"
#include "server/reduction/snapshot_set.hpp"

namespace palpate {

struct PodBasis {
  Matrix modes;         ///< V, orthonormal in M
  Matrix coordinates;   ///< V^T M W, r x m
  Projection at_modes;  ///< V^T K V and V^T D V
};

/// `beside`: additional directions, 3 N each, fewer than `modes`. `snapshots`: at least one.
PodBasis pod_basis(const Linearisation& at, const SnapshotSet& snapshots, std::span<const Vector> beside, double shift_1_s,
                   int modes);

}  // namespace palpate
