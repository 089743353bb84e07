// The directions of a nonlinear patch: their orthonormality, and the values of K and D on them.
#include "server/reduction/pod_basis.hpp"

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
  WholeBody whole{dynamics, state};
  Linearisation at{whole, body.fixed};
  ShiftedSolver solver{dynamics};

  Bench() { REQUIRE(solver.prepare(at, kShift, true)); }
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
};

}  // namespace

TEST_CASE("Directions of snapshots are orthonormal in M, however alike these are, and K and D on them are theirs") {
  Bench bench;
  const Vector zero = Vector::Zero(bench.dynamics.masses().size());
  const auto last = static_cast<std::uint32_t>(bench.dynamics.nodes() - 1);
  const Vector first = bench.response(bench.load(last)), other = bench.response(bench.load(last - 8));
  // The third has some 1e-9 of the energy of the first.
  SnapshotSet snapshots;
  snapshots.add(SnapshotKind::port_response, first);
  snapshots.add(SnapshotKind::port_response, other, 0.3);
  snapshots.add(SnapshotKind::port_response, first + 1e-3 * bench.response(bench.load(last - 3)));
  snapshots.add(SnapshotKind::own_motion, bench.state.v, 0.1);
  snapshots.add(SnapshotKind::residual, zero);
  const std::vector<Vector> beside{bench.load(last)};
  const PodBasis basis = pod_basis(bench.at, snapshots, beside, kShift, 8);
  const Matrix& v = basis.modes;
  REQUIRE(v.cols() == 5);
  const auto along_modes = [&](const Vector& x) -> Vector { return v.transpose() * bench.dynamics.masses().cwiseProduct(x); };
  CHECK((v.transpose() * bench.dynamics.masses().asDiagonal() * v - Matrix::Identity(v.cols(), v.cols())).norm() < 1e-9);
  const Projection projected = bench.at.projected(v);
  CHECK((basis.at_modes.k - projected.k).norm() < 1e-7 * projected.k.norm());
  CHECK((basis.at_modes.d - projected.d).norm() < 1e-7 * projected.d.norm());
  // Snapshots are spanned up to 1e-10 of the energy, with the given coordinates; additional directions are spanned exactly.
  CHECK((v * basis.coordinates.col(0) - first).norm() < 1e-5 * first.norm());
  const Vector apart = snapshots.all()[2].state - first;
  CHECK((v * along_modes(apart) - apart).norm() < 0.05 * apart.norm());
  CHECK((v * along_modes(beside[0]) - beside[0]).norm() < 1e-9 * beside[0].norm());
  for (Eigen::Index k = 0; k < snapshots.count(); ++k) {
    Matrix state = snapshots.weighted().col(k);
    mask(bench.body.fixed, state);
    CHECK((basis.coordinates.col(k) - along_modes(state)).norm() < 1e-9 * (1e-12 + along_modes(state).norm()));
  }
}

TEST_CASE("Snapshots have no directions where nothing moves") {
  Bench bench;
  SnapshotSet snapshots;
  for (int k = 0; k < 3; ++k) snapshots.add(SnapshotKind::rest, Vector::Zero(bench.dynamics.masses().size()));
  const PodBasis basis = pod_basis(bench.at, snapshots, {}, kShift, 8);
  CHECK(basis.modes.cols() == 0);
  CHECK(basis.modes.rows() == bench.dynamics.masses().size());
}

TEST_CASE("A set of snapshots knows which are of a kind, and counts each by its weight") {
  SnapshotSet snapshots, more;
  snapshots.add(SnapshotKind::rollout, Vector::Constant(3, 2.0), 0.5);
  more.add(SnapshotKind::rest, Vector::Constant(3, 1.0));
  more.add(SnapshotKind::rollout, Vector::Constant(3, 3.0));
  snapshots.add(more);
  CHECK(snapshots.of(SnapshotKind::rollout) == std::vector<Eigen::Index>{0, 2});
  CHECK(snapshots.of(SnapshotKind::history).empty());
  Matrix expected(3, 3);
  expected.rowwise() = Eigen::RowVector3d(1, 1, 3);
  CHECK(snapshots.weighted() == expected);
}

TEST_CASE(
    "A touched body is likeliest to come to where rollouts end, or else to where it is indented, a grasped one to its port "
    "responses") {
  SnapshotSet snapshots;
  const auto add = [&](SnapshotKind kind) { snapshots.add(kind, Vector::Zero(3)); };
  add(SnapshotKind::port_response);
  add(SnapshotKind::rest);
  add(SnapshotKind::rollout_end);
  CHECK(snapshots.likeliest() == std::vector<Eigen::Index>{0});
  add(SnapshotKind::indentation);
  CHECK(snapshots.likeliest() == std::vector<Eigen::Index>{2});
  SnapshotSet costly;  // a body without rollouts
  costly.add(SnapshotKind::port_response, Vector::Zero(3));
  for (int k = 0; k < 2; ++k) costly.add(SnapshotKind::indentation, Vector::Zero(3));
  CHECK(costly.likeliest() == std::vector<Eigen::Index>{1, 2});
}
