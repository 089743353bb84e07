// Many right-hand sides at once against dense factorisation.
#include "server/body/batch_cg.hpp"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct BatchSystem {
  LumpedBody body;
  Dynamics dynamics{body};
  BodyState state = random_state(dynamics, 1, 0.002, 0.1);
  BlockMatrix a = dynamics.make_matrix();
  BatchConjugateGradients solver;
  std::vector<Vector> b, x;

  explicit BatchSystem(std::size_t columns, double c_m = 400, double c_d = 20, double c_k = 1, LumpedBody of = box_body(4, 4, 4))
      : body(std::move(of)), x(columns) {
    dynamics.assemble(state, c_m, c_d, c_k, body.fixed, true, a);
    solver.prepare(a, body.fixed);
    Random random(2);
    for (std::size_t k = 0; k < columns; ++k) {
      b.emplace_back(Vector(3 * static_cast<Eigen::Index>(a.rows())));
      for (double& value : b.back()) value = std::pow(10.0, static_cast<double>(k) - 4) * random.uniform(-1, 1);
      mask(body.fixed, b.back());
    }
  }
  int solve(double tolerance, bool& definite) {
    std::vector<SolveColumn> columns;
    for (std::size_t k = 0; k < b.size(); ++k) columns.push_back({&b[k], &x[k]});
    return solver.solve(columns, tolerance, definite);
  }
  Matrix dense_a() const {
    Vector y;
    return dense(3 * static_cast<Eigen::Index>(a.rows()), [&](const Vector& v) { return a.multiply(v, y), y; });
  }
};

}  // namespace

TEST_CASE("More columns than go side by side, of very different size, are each solved to their tolerance") {
  const double tolerance = GENERATE(1e-1, 1e-3, 1e-5);
  const bool solid = GENERATE(false, true);
  BatchSystem system(19, 400, 20, 1, solid ? solid_box(4, 4, 4, {SolidLaw::corotational, 4000, 0.4, 0.05}) : box_body(4, 4, 4));
  bool definite = true;
  CHECK(system.solve(tolerance, definite) > 19);
  CHECK(definite);
  const auto exact = system.dense_a().llt();
  for (std::size_t k = 0; k < system.b.size(); ++k) {
    Vector ax;
    system.a.multiply(system.x[k], ax);
    CHECK((ax - system.b[k]).norm() < 1.05 * tolerance * system.b[k].norm());
    const Vector answer = exact.solve(system.b[k]);
    if (tolerance == 1e-5) CHECK((system.x[k] - answer).norm() < 1e-4 * answer.norm());
  }
}

TEST_CASE("A column's answer is the same to the bit whoever goes beside it") {
  BatchSystem all(11), alone(11);
  bool definite = true;
  all.solve(1e-3, definite);
  for (std::size_t k = 0; k < alone.b.size(); ++k) {
    const SolveColumn column{&alone.b[k], &alone.x[k]};
    alone.solver.solve(std::span(&column, 1), 1e-3, definite);
    CHECK(alone.x[k] == all.x[k]);
  }
}

TEST_CASE("A column that is needed less exactly stops earlier, and those beside it do not") {
  BatchSystem system(4), exactly(4);
  constexpr double kTolerance = 1e-4, kLooser = 100;
  bool definite = true;
  std::vector<SolveColumn> columns;
  for (std::size_t k = 0; k < 4; ++k) columns.push_back({&system.b[k], &system.x[k], k < 2 ? kLooser : 1});
  const int iterations = system.solver.solve(columns, kTolerance, definite);
  CHECK(iterations < exactly.solve(kTolerance, definite) - 4);
  for (std::size_t k = 0; k < 4; ++k) {
    Vector ax;
    system.a.multiply(system.x[k], ax);
    const double wrong = (ax - system.b[k]).norm() / system.b[k].norm();
    CHECK(wrong < 1.05 * kTolerance * columns[k].tolerance_factor);
    CHECK((wrong > 2 * kTolerance) == (k < 2));
    CHECK((system.x[k] == exactly.x[k]) == (k >= 2));
  }
}

TEST_CASE("A first guess that answers is left as it is, and one of nothing answers nothing") {
  BatchSystem system(3);
  const auto exact = system.dense_a().llt();
  for (std::size_t k = 0; k < 2; ++k) system.x[k] = exact.solve(system.b[k]);
  system.b[1].setZero();
  bool definite = true;
  const Vector answer = system.x[0];
  system.b.resize(2);
  CHECK(system.solve(1e-3, definite) == 0);
  CHECK((system.x[0] - answer).norm() < 1e-6 * answer.norm());
  CHECK(system.x[1].isZero(0));
}

TEST_CASE("Rows of held nodes are taken for zero and stay so") {
  BatchSystem system(2);
  for (Vector& b : system.b) b.setOnes();
  for (Vector& x : system.x) x.setOnes(system.b[0].size());
  bool definite = true;
  system.solve(1e-3, definite);
  Vector masked = system.b[0];
  mask(system.body.fixed, masked);
  const Vector answer = system.dense_a().llt().solve(masked);
  CHECK((system.x[1] - answer).norm() < 1e-2 * answer.norm());
  for (std::uint32_t i = 0; i < system.body.fixed.size(); ++i)
    if (system.body.fixed[i]) CHECK(node_of(system.x[1], i).isZero(0));
}

TEST_CASE("Columns side by side report a matrix that is not positive definite") {
  BatchSystem system(9, 1, 0, -0.01);
  bool definite = true;
  system.solve(1e-5, definite);
  CHECK_FALSE(definite);
}
