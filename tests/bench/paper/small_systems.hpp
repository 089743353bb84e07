// Small linear systems for the tests of server/linear, and a dense Lyapunov solver.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "bench/paper/state_space.hpp"
#include "server/scene/scene.hpp"
#include "tests/support/bodies.hpp"

namespace palpate::test {

/// box_body(3, 3, 3) at rest, held at the middle of its top: 51 coordinates, 3 ports.
inline SecondOrderSystem small_cube(double damping_n_s_m = 0.24) {
  const LumpedBody body = box_body(3, 3, 3, 60, damping_n_s_m);
  const Dynamics dynamics(body);
  return second_order_system(dynamics, dynamics.rest_state(), 22, {});
}

/// scenes/sheet13.json, the paper's mesh, with another damping.
inline SecondOrderSystem sheet(double damping_n_s_m) {
  Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/sheet13.json");
  for (Element& e : scene.body.elements) e.damping_n_s_m = damping_n_s_m;
  const Dynamics dynamics(scene.body);
  return second_order_system(dynamics, dynamics.rest_state(), scene.tool.node, {});
}

/// Solution X of A X + X A^T + R = 0, by the eigenvectors of A.
inline Matrix lyapunov(const Matrix& a, const Matrix& r) {
  const Eigen::EigenSolver<Matrix> eigen(a);
  const ComplexMatrix x = eigen.eigenvectors(), inverse = x.inverse();
  ComplexMatrix y = inverse * r.cast<Complex>() * inverse.adjoint();
  for (Eigen::Index i = 0; i < y.rows(); ++i)
    for (Eigen::Index j = 0; j < y.cols(); ++j) y(i, j) /= -(eigen.eigenvalues()[i] + std::conj(eigen.eigenvalues()[j]));
  return (x * y * x.adjoint()).real();
}

}  // namespace palpate::test
