// The forces of a body beyond their tangent, expanded on a few shapes: what scheme `cubic` sends (cubic_terms.hpp).
//
// x = x* + W y, W of shape 3 N x n. Every spring's energy U(|d|), d = x_b - x_a, depends on y through the stretch along its axis
// a = n . delta and the square b of the motion across it, delta = G y. With rho = |d*|, U' = T, U'' = T', ... at its elongation:
//     third order     a (alpha b + beta a^2)                alpha = (U'' - U'/rho) / (2 rho),   beta = U'''/6
//     fourth order    gamma a^2 b + delta b^2 + epsilon a^4   gamma = (U'/rho - U'')/(2 rho^2) + U'''/(4 rho),
//                                                             delta = (U'' - U'/rho) / (8 rho^2),   epsilon = U''''/24
// exactly; sums over elements are matrix products of their features. Elements that hardly contribute are left out: of the sum of
// |k| delta^3 / rho over all elements no more than `negligible` is.
// Source: Taylor series of the spring's energy; for finite elements Barbic and James, SIGGRAPH (2005).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/port/cubic_terms.hpp"
#include "server/body/dynamics.hpp"

namespace palpate {

struct Expansion {
  Eigen::VectorXf e3, e4;  ///< monomials of all variables; of the leading ones
  Eigen::MatrixXf q;       ///< leading x pairs
  int elements = 0;        ///< that were not left out
};

/// Whether a body's forces have a Taylor series at every state that is known here: springs of a law that has_series(); not
/// thigh_skin, whose second derivative jumps at rest, and not finite elements.
bool can_expand(const LumpedBody& body);
/// Whether a body's forces are known beyond their tangents, to second order and any number of elements at a time: what
/// can_expand(), and finite elements whose materials have one law.
bool can_bend(const LumpedBody& body);

/// Nothing for a body that cannot be expanded, and when an element has no length.
std::optional<Expansion> expand(const Dynamics& dynamics, const BodyState& state, const Matrix& shapes, int leading,
                                double negligible = 2e-3);

/// Elements that bend when the body moves by these shapes, in the body's order: see `negligible` above; of tetrahedra the sum is
/// of V mu_L |dF|^3. At most `most`, those that bend most. For a body that can_bend().
std::vector<std::uint32_t> elements_that_bend(const Dynamics& dynamics, const BodyState& state, const Matrix& shapes,
                                              double negligible, std::size_t most);

/// Second-order forces on the nodes: with delta = sum_i y_i directions_i, F(x* + delta) = F - K delta + sum_{i<=j} y_i y_j F2_ij
/// + ...; F2_ij at pair_at(i, j). For a body that can_bend().
std::vector<Vector> second_order_forces(const Dynamics& dynamics, const BodyState& state, const Matrix& directions);

}  // namespace palpate
