// Linear systems in state space, z' = A z + B u, y = C z + D0 u + D1 u':
//     G(s) = C (s I - A)^-1 B + D0 + s D1
#pragma once

#include "bench/paper/second_order.hpp"

namespace palpate {

struct StateSpace {
  Matrix a, b, c;  ///< N x N, N x p, p x N
  Matrix d0, d1;   ///< p x p feed-through; D1 grows with s (a damper at the port)

  Eigen::Index states() const { return a.rows(); }
  ComplexMatrix transfer(Complex s) const;
  /// Eigenvalues of A [rad/s].
  Eigen::VectorXcd poles() const;
};

/// Returns the same G(s) with states z = (M^1/2 q, M^1/2 q' - M^-1/2 B_d d): 2 n states. The output is minus the force on the
/// port's neighbours, that is y = f of second_order.hpp.
StateSpace state_space(const SecondOrderSystem& system);

}  // namespace palpate
