// The directions of a nonlinear patch: what they are orthonormal in, and that K and D on them are what it is said to be.
#include "server/reduce/hyper_basis.hpp"

#include <catch2/catch.hpp>

#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kShift = 20;

struct Bench {
  LumpedBody body = box_body(6, 5, 5);
  Dynamics dynamics{body};
  BodyState state = random_state(dynamics, 2, 0.001, 0.05);
  Tangents tangents{dynamics};
  Linearisation at{&dynamics, &state, &body.fixed, &tangents};
  ShiftedSolver solver{dynamics};
  BasisMemory memory;

  Bench() {
    tangents.take(state);
    REQUIRE(solver.prepare(at, kShift, true));
  }
  Vector load(std::uint32_t node) const {
    Vector b = Vector::Zero(dynamics.masses().size());
    at_node(b, node) = Vec3(0.3, 0.1, -1);
    mask(body.fixed, b);
    return b;
  }
  Vector response(const Vector& b) {
    Vector x = Vector::Zero(b.size());
    REQUIRE(solver.solve(at, b, 1e-6, x));
    return x;
  }
  std::optional<HyperBasis> basis(const KrylovStart& start) {
    const KrylovSolve solve = [&](std::span<const SolveColumn> columns) { return solver.solve(at, columns, 1e-3); };
    const std::vector<Vector> indentations{start.ports.front()};
    return hyper_basis(at, start, solve, Matrix(), indentations, Matrix(dynamics.masses().size(), 0), {8, kShift, 0.1}, memory);
  }
};

}  // namespace

TEST_CASE("Directions of a nonlinear patch are orthonormal in M, however alike the candidates, and K and D on them are theirs") {
  Bench bench;
  const Vector zero = Vector::Zero(bench.dynamics.masses().size());
  const auto last = static_cast<std::uint32_t>(bench.dynamics.nodes() - 1);
  const Vector first = bench.response(bench.load(last)), other = bench.response(bench.load(last - 8));
  // Of the energy of the first the third adds some 1e-9.
  KrylovStart start{{first, 0.3 * other, first + 1e-3 * bench.response(bench.load(last - 3))}, {bench.load(last)}, zero, zero};
  const auto basis = bench.basis(start);
  REQUIRE(basis);
  const Matrix& v = basis->shapes;
  REQUIRE(v.cols() >= 6);
  CHECK((v.transpose() * bench.dynamics.masses().asDiagonal() * v - Matrix::Identity(v.cols(), v.cols())).norm() < 1e-9);
  const Projection projected = bench.at.projected(v);
  CHECK((basis->at_shapes.k - projected.k).norm() < 1e-7 * projected.k.norm());
  CHECK((basis->at_shapes.d - projected.d).norm() < 1e-7 * projected.d.norm());
  // Candidates are spanned but for 1e-10 of the energy, and their coordinates say how.
  CHECK((v * basis->coordinates.col(0) - first).norm() < 1e-5 * first.norm());
  const Vector apart = start.ports[2] - first;
  CHECK((v * (v.transpose() * bench.dynamics.masses().cwiseProduct(apart)) - apart).norm() < 0.05 * apart.norm());
}

TEST_CASE("A nonlinear patch has no directions where nothing moves") {
  Bench bench;
  bench.state.v.setZero();
  const Vector zero = Vector::Zero(bench.dynamics.masses().size());
  const auto basis = bench.basis({{zero, zero, zero}, {}, zero, zero});
  REQUIRE(basis);
  CHECK(basis->shapes.cols() == 0);
  CHECK(basis->shapes.rows() == zero.size());
}
