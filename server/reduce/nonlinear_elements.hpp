// Which elements of a body answer nonlinearly when it moves by a few shapes, and the forces of second order that this makes.
//
// x = x* + W y, W of shape 3 N x n. Every spring's energy U(|d|), d = x_b - x_a, depends on y through the stretch along its axis
// a = n . delta and the motion across it c = delta - a n, delta = G y. With rho = |d*|, U' = T, U'' = T', ... at its elongation,
// its energy of third order is a (alpha |c|^2 + beta a^2), alpha = (U'' - U'/rho) / (2 rho), beta = U''' / 6, exactly. Of a
// finite element the second-order stress is its law's (server/body/tetra_kernel.hpp, hexa_kernel.hpp).
#pragma once

#include <cstdint>
#include <vector>

#include "common/port/nonlinear_terms.hpp"
#include "server/body/dynamics.hpp"

namespace palpate {

inline constexpr double kElementLengthMinM = 1e-9;  ///< a spring that is shorter has no direction; no mesh comes near it

/// Whether a body's forces are known beyond their tangents, to second order and any number of elements at a time: springs of a
/// smooth law (not thigh_skin, whose second derivative jumps at rest), or finite elements of one kind whose materials have one
/// law.
bool has_nonlinear_elements(const LumpedBody& body);

/// The most nonlinear elements when the body moves by these shapes, in the body's order. What is left out is least so: of the sum
/// over all elements of k |delta|^3 / rho (of finite elements V mu_L |dF|^3) no more than `negligible`; at most `most` elements,
/// those with the largest parts. For a body that has_nonlinear_elements().
std::vector<std::uint32_t> nonlinear_elements(const Dynamics& dynamics, const BodyState& state, const Matrix& shapes,
                                              double negligible, std::size_t most);

/// Second-order forces on the nodes: with delta = sum_i y_i directions_i, F(x* + delta) = F - K delta + sum_{i<=j} y_i y_j F2_ij
/// + ...; F2_ij at pair_at(i, j). For a body that has_nonlinear_elements().
std::vector<Vector> second_order_forces(const Dynamics& dynamics, const BodyState& state, const Matrix& directions);

}  // namespace palpate
