// Linear systems at a port against dense linear algebra.
#include <catch2/catch.hpp>

#include "tests/bench/paper/small_systems.hpp"

using namespace palpate;
using namespace palpate::test;

TEST_CASE("The sparse factorisation solves as dense algebra does, off the axis and on it") {
  const SecondOrderSystem y = small_cube();
  const DynamicStiffness dynamic(y.mass, y.damping, y.stiffness);
  const ComplexMatrix b = (y.b_k + 0.1 * Matrix::Random(y.size(), y.ports())).cast<Complex>();
  for (const Complex s : {Complex(0, 0), Complex(30, 0), Complex(10, 200), Complex(0, 40), Complex(0, 3000)}) {
    ComplexMatrix p = (Matrix(y.stiffness)).cast<Complex>() + s * Matrix(y.damping).cast<Complex>();
    p.diagonal() += s * s * y.mass.cast<Complex>();
    const ComplexMatrix exact = p.partialPivLu().solve(b);
    CHECK((dynamic.at(s).solve(b) - exact).norm() < 1e-11 * exact.norm());
  }
}

TEST_CASE("The signs of the pivots are the inertia of the stiffness") {
  SecondOrderSystem y = small_cube();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen{Matrix(y.stiffness)};
  // Between the third and the fourth eigenvalue, so three pivots are negative.
  const double shift = 0.5 * (eigen.eigenvalues()[2] + eigen.eigenvalues()[3]);
  for (Eigen::Index i = 0; i < y.size(); ++i) y.stiffness.coeffRef(i, i) -= shift;
  const auto at = DynamicStiffness(y.mass, y.damping, y.stiffness).at(0);
  CHECK((at.pivots().real().array() < 0).count() == 3);
}

TEST_CASE("State space and second order have the same transfer function") {
  const SecondOrderSystem y = small_cube();
  const StateSpace z = state_space(y);
  const TransferFunction g(y);
  for (const Complex s : {Complex(0, 0), Complex(5, 0), Complex(0, 70), Complex(3, -2000)})
    CHECK((g(s) - z.transfer(s)).norm() < 1e-9 * g(s).norm());
}

TEST_CASE("The sheet of the paper has 524 states: nothing moves across its plane") {
  const SecondOrderSystem y = sheet(0.5);
  CHECK(y.size() == 262);
  CHECK(y.ports() == 2);
  CHECK(state_space(y).states() == 524);
}

TEST_CASE("A projection onto every direction changes nothing, and onto some it stays symmetric") {
  const SecondOrderSystem y = small_cube();
  const SecondOrderSystem all = project(y, Matrix::Identity(y.size(), y.size()) * 3);
  const Complex s(2, 90);
  const TransferFunction g(y);
  CHECK((TransferFunction(all)(s) - g(s)).norm() < 1e-10 * g(s).norm());
  const SecondOrderSystem some = project(y, Matrix::Random(y.size(), 6));
  CHECK((Matrix(some.stiffness) - Matrix(some.stiffness).transpose()).norm() < 1e-12 * some.stiffness.norm());
  CHECK(some.mass == Vector::Ones(6));
}
