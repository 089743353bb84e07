// What the hourglass modes of some hexahedra (server/body/hexa_kernel.hpp) push beyond their tangents.
//
// At (F, q), with b_a = F^T q_a, s = C b and a change (dF, dq), b changes to first and second order by b_1 = dF^T q + F^T dq and
// b_2 = dF^T dq, and with s_1 = C b_1, s_2 = C b_2 the stress beyond the linear one is, exactly,
//
//     on F: q s_2^T + dq (s_1 + s_2)^T,     on q: F s_2 + dF (s_1 + s_2)
//
// The samples that stand for all elements (sample_tetrahedra.hpp) have mean gradients only; they are fitted to forces with these
// in them, which a patch is truer for: 2.8 / 2.7 / 2.8 dB at 50 / 150 / 300 ms on an organ of cells of 12.5 mm.
#pragma once

#include <span>

#include "server/body/dynamics.hpp"
#include "server/reduce/sampling.hpp"

namespace palpate {

/// As forces on the variables, n x samples, of a body at positions x whose nodes move by `moved`, 3 N x n, at the samples `u`.
Eigen::MatrixXf hourglass_forces(const Dynamics& dynamics, const Vector& x, std::span<const std::uint32_t> hexahedra,
                                 const Matrix& moved, const Eigen::MatrixXf& u);

}  // namespace palpate
