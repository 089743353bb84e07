// The direct and the iterative solver against dense factorisation.
#include "server/solve/linear_solver.hpp"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <cmath>

#include "server/body/batch_cg.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct System {
  LumpedBody body = box_body(4, 3, 3);
  Dynamics dynamics{body};
  BlockMatrix a = dynamics.make_matrix();

  System(double c_m, double c_d, double c_k) {
    dynamics.assemble(random_state(dynamics, 1, 0.003, 0.1), c_m, c_d, c_k, body.fixed, false, a);
  }
  Matrix dense_a() const {
    Vector y;
    return dense(3 * static_cast<Eigen::Index>(a.rows()), [&](const Vector& x) { return a.multiply(x, y), y; });
  }
  Vector right_side() const {
    Random random(2);
    Vector b(3 * static_cast<Eigen::Index>(a.rows()));
    for (double& value : b) value = random.uniform(-1, 1);
    return b;
  }
};

}  // namespace

TEST_CASE("Direct, iterative and chosen by itself, the solver gives the dense answer") {
  const auto method =
      GENERATE(LinearSolver::Method::direct, LinearSolver::Method::conjugate_gradients, LinearSolver::Method::automatic);
  const double a = GENERATE(1e-4, 3e-3, 0.05);
  const System system(1, a, a * a);
  const Vector b = system.right_side(), exact = system.dense_a().llt().solve(b);
  LinearSolver solver(system.a.rows(), method);
  for (int again = 0; again < 2; ++again) {
    REQUIRE(solver.factorise(system.a));
    Vector x = Vector::Zero(b.size());
    const SolveStats stats = solver.solve(b, 1e-12, x);
    CHECK(stats.positive_definite);
    CHECK((stats.iterations == 0) == solver.is_direct());
    CHECK((x - exact).norm() < 1e-8 * exact.norm());
  }
}

TEST_CASE("A warm start at the answer needs no iteration") {
  const System system(1, 0.003, 1e-5);
  const Vector b = system.right_side();
  Vector x = system.dense_a().llt().solve(b);
  LinearSolver solver(system.a.rows(), LinearSolver::Method::conjugate_gradients);
  REQUIRE(solver.factorise(system.a));
  CHECK(solver.solve(b, 1e-6, x).iterations == 0);
}

TEST_CASE("A matrix that is not positive definite is reported by both methods") {
  const System system(1, 0, -0.01);
  LinearSolver direct(system.a.rows(), LinearSolver::Method::direct);
  CHECK_FALSE(direct.factorise(system.a));
  LinearSolver iterative(system.a.rows(), LinearSolver::Method::conjugate_gradients);
  Vector x;
  CHECK_FALSE((iterative.factorise(system.a) && iterative.solve(system.right_side(), 1e-10, x).positive_definite));
}

TEST_CASE("A product with the block matrix is the dense product") {
  const System system(1, 0.01, 0.01);
  const Vector x = system.right_side();
  Vector y;
  system.a.multiply(x, y);
  CHECK((y - system.dense_a() * x).norm() < 1e-13 * y.norm());
  CHECK(system.a.column(system.a.find(5, 6)) == 6);
  CHECK(system.a.column(system.a.diagonal(7)) == 7);
}

TEST_CASE("Iterations stop where the preconditioned residual is as small as was asked, and no sooner") {
  const System system(1, 0.01, 1e-4);
  const Vector b = system.right_side(), exact = system.dense_a().llt().solve(b);
  SsorConjugateGradients solver;
  REQUIRE(solver.pack(system.a));
  int before = 0;
  double error_before = 1;
  for (const double tolerance : {1e-1, 1e-2, 1e-3, 1e-4}) {
    Vector x = Vector::Zero(b.size());
    bool positive_definite = true;
    const int iterations = solver.solve(b, tolerance, x, positive_definite);
    const Vector wrong = x - exact;
    const double error = std::sqrt(wrong.dot(system.dense_a() * wrong) / exact.dot(system.dense_a() * exact));
    CHECK(positive_definite);
    CHECK(iterations > before);
    CHECK(error < 3 * tolerance);
    CHECK(error < error_before);
    before = iterations;
    error_before = error;
  }
}

TEST_CASE("A body of rows that do not depend on each other is solved for in one iteration") {
  const System system(1, 0, 0);  // masses alone
  const Vector b = system.right_side();
  SsorConjugateGradients solver;
  REQUIRE(solver.pack(system.a));
  Vector x = Vector::Zero(b.size());
  bool positive_definite = true;
  CHECK(solver.solve(b, 1e-6, x, positive_definite) == 1);
  CHECK((system.dense_a() * x - b).norm() < 1e-6 * b.norm());
}

TEST_CASE("Iterations with the lower triangle as preconditioner are at most six tenths of those with the diagonal") {
  const System system(1, 0.02, 4e-4);
  const Vector b = system.right_side();
  SsorConjugateGradients solver;
  REQUIRE(solver.pack(system.a));
  Vector x = Vector::Zero(b.size()), y;
  bool positive_definite = true;
  const int iterations = solver.solve(b, 1e-3, x, positive_definite);
  BatchConjugateGradients jacobi;
  jacobi.prepare(system.a, system.body.fixed);
  const int of_jacobi = jacobi.solve(std::vector{SolveColumn{&b, &y}}, 1e-3, positive_definite);
  REQUIRE(of_jacobi > 10);
  CHECK(iterations <= 0.6 * of_jacobi);
}
