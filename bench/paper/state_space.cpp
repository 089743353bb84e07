#include "bench/paper/state_space.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace palpate {

ComplexMatrix StateSpace::transfer(Complex s) const {
  ComplexMatrix p = -a.cast<Complex>();
  p.diagonal().array() += s;
  return c.cast<Complex>() * p.partialPivLu().solve(b.cast<Complex>()) + d0.cast<Complex>() + s * d1.cast<Complex>();
}

Eigen::VectorXcd StateSpace::poles() const { return a.eigenvalues(); }

StateSpace state_space(const SecondOrderSystem& system) {
  const Eigen::Index n = system.size(), p = system.ports();
  const Vector scale = system.mass.cwiseSqrt().cwiseInverse();
  const Matrix k = scale.asDiagonal() * Matrix(system.stiffness) * scale.asDiagonal();
  const Matrix d = scale.asDiagonal() * Matrix(system.damping) * scale.asDiagonal();
  const Matrix b_k = scale.asDiagonal() * system.b_k, b_d = scale.asDiagonal() * system.b_d;
  StateSpace s;
  s.a = Matrix::Zero(2 * n, 2 * n);
  s.a.topRightCorner(n, n).setIdentity();
  s.a.bottomLeftCorner(n, n) = -k;
  s.a.bottomRightCorner(n, n) = -d;
  s.b.resize(2 * n, p);
  s.b << b_d, b_k - d * b_d;
  s.c.resize(p, 2 * n);
  s.c << -b_k.transpose(), -b_d.transpose();
  s.d0 = system.k_port - b_d.transpose() * b_d;
  s.d1 = system.d_port;
  return s;
}

}  // namespace palpate
