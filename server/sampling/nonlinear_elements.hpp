// Selects the elements of a body that respond nonlinearly when it moves by a few shapes, and computes their second-order forces.
//
// x = x* + W y, W of shape 3 N x n. The energy U(|d|) of a spring, d = x_b - x_a, depends on y through its stretch along its axis
// a = n . delta and the motion across it c = delta - a n, delta = G y. With rho = |d*|, U' = T, U'' = T', ... at its elongation,
// its third-order energy is exactly a (alpha |c|^2 + beta a^2), alpha = (U'' - U'/rho) / (2 rho), beta = U''' / 6. The
// second-order stress of a finite element comes from differences of its law's stress (common/mechanics/laws.hpp).
#pragma once

#include <cstdint>
#include <vector>

#include "common/patch/nonlinear_terms.hpp"
#include "server/body/dynamics.hpp"

namespace palpate {

inline constexpr double kElementLengthMinM = 1e-9;  ///< a shorter spring has no direction; no mesh has one

/// Returns true if a body's forces can be computed beyond their tangents, to second order and for any subset of elements: springs
/// of a smooth law (not thigh_skin, whose second derivative jumps at rest), or finite elements of one kind whose materials have
/// one law.
bool has_nonlinear_elements(const LumpedBody& body);

/// Returns the most nonlinear elements when the body moves by these shapes, in the body's order. The least nonlinear ones are
/// left out: their share of the sum over all elements of k |delta|^3 / rho (for finite elements V mu_L |dF|^3) is at most
/// `negligible`. Returns at most `most` elements, those with the largest contributions. Requires a body that
/// has_nonlinear_elements().
std::vector<std::uint32_t> nonlinear_elements(const Dynamics& dynamics, const BodyState& state, const Matrix& shapes,
                                              double negligible, std::size_t most);

/// Returns second-order nodal forces: with delta = sum_i y_i directions_i,
/// F(x* + delta) = F - K delta + sum_{i<=j} y_i y_j F2_ij + ...; F2_ij at pair_at(i, j). Requires a body that
/// has_nonlinear_elements().
std::vector<Vector> second_order_forces(const Dynamics& dynamics, const BodyState& state, const Matrix& directions);

}  // namespace palpate
