// Few modes chosen from many, against the whole body and against as many Krylov directions.
#include "server/reduce/narrow_basis.hpp"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <numbers>

#include "server/linear/second_order.hpp"
#include "server/reduce/patch_builder.hpp"
#include "server/systems/hinf.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kHorizon{200'000};
constexpr double kNarrowShift = 10;  // 2 / horizon
constexpr int kModes = 8, kWide = 12;
constexpr double kLightDamping = 0.24 / 20;

/// A box, a little out of balance and moving, grasped at a node of its upper face.
struct Grasped {
  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  BodyState state;
  std::uint32_t node;
  std::vector<std::uint8_t> held;
  Tangents tangents{dynamics};
  SecondOrderSystem whole;
  Linearisation at{&dynamics, &state, &held, &tangents};

  explicit Grasped(double damping_n_s_m, int edge = 6)
      : body(box_body(edge, edge, edge, 60, damping_n_s_m)),
        state(random_state(dynamics, 5, 1e-5, 1e-4)),
        node(static_cast<std::uint32_t>(2 + edge * (2 + edge * (edge - 1)))),
        held(body.fixed),
        whole(second_order_system(dynamics, state, node, {})) {
    held[node] = 1;
    tangents.take(state);
  }

  std::vector<Vector> ports() const {
    std::vector<Vector> b(3, Vector::Zero(state.x.size()));
    for (Eigen::Index row = 0; row < whole.size(); ++row)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto column = static_cast<Eigen::Index>(axis);
        b[axis][whole.coordinates[static_cast<std::size_t>(row)]] =
            whole.b_k(row, column) + kNarrowShift * whole.b_d(row, column);
      }
    return b;
  }
  Vector residual() const {
    Vector f;
    dynamics.forces(state.x, state.v, f);
    mask(held, f);
    return f;
  }
  Matrix krylov(int modes, const std::vector<Vector>& ports) const {
    ShiftedSolver solver(dynamics);
    REQUIRE(solver.prepare(at, kNarrowShift, false));
    BasisMemory memory;
    const auto basis = krylov_basis(at, solver, ports, {}, residual(), {modes, kNarrowShift, 1e-10}, memory);
    REQUIRE(basis);
    return *basis;
  }
  Matrix chosen(const std::vector<Vector>& ports) const {
    return narrowed(at, krylov(kWide, ports), ports, residual(), {kModes, kNarrowShift, seconds(kHorizon)});
  }
  SecondOrderSystem projected(const Matrix& v) const { return project(whole, v(whole.coordinates, Eigen::all)); }

  Patch patch(PatchBuilder& builder) {
    std::vector<ToolPort> ports(1);
    ports[0].kind = ContactKind::attach;
    ports[0].node = node;
    ports[0].lambda = -dynamics.element_force(state, node);
    const ToolAt tool{node_of(state.x, node), node_of(state.v, node)};
    PatchRequest request{.scheme = Scheme::port, .order = 2 * kModes, .horizon = kHorizon};
    FrameModel frame(dynamics, skin);
    frame.begin(state, ports, std::span(&tool, 1), request.horizon);
    auto built = builder.build(frame, 0, request);
    REQUIRE(built);
    return *built;
  }
};

/// Largest error of the force per displacement that a tool feels who moves at up to 10 Hz, over the prediction horizon: s = 1 / T
/// + i w.
double error(const SecondOrderSystem& whole, const SecondOrderSystem& reduced) {
  const TransferFunction g(whole), g_r(reduced);
  double worst = 0;
  for (double hz = 0; hz <= 10; hz += 0.25) {
    const Complex s(1 / seconds(kHorizon), 2 * std::numbers::pi * hz);
    worst = std::max(worst, largest_singular_value(g(s) - g_r(s)) / largest_singular_value(g(s)));
  }
  return worst;
}

Matrix gram(const Grasped& bench, const Matrix& v) { return v.transpose() * bench.dynamics.masses().asDiagonal() * v; }

}  // namespace

TEST_CASE("Chosen modes are orthonormal in the mass matrix and leave held nodes alone") {
  const Grasped bench(kLightDamping);
  const Matrix v = bench.chosen(bench.ports());
  REQUIRE(v.cols() == kModes);
  CHECK(gram(bench, v).isApprox(Matrix::Identity(kModes, kModes), 1e-10));
  for (std::size_t i = 0; i < bench.held.size(); ++i)
    if (bench.held[i]) CHECK(v.middleRows<3>(3 * static_cast<Eigen::Index>(i)).isZero(0));
}

TEST_CASE("An axis of the port at which nothing pulls gets no direction of its own") {
  const Grasped bench(kLightDamping);
  std::vector<Vector> ports = bench.ports();
  ports[2].setZero();
  const Matrix v = bench.chosen(ports);
  REQUIRE(v.cols() == kModes);
  CHECK(gram(bench, v).isApprox(Matrix::Identity(kModes, kModes), 1e-10));
}

TEST_CASE("Chosen modes respond at the port at the shift as the whole body does") {
  const Grasped bench(kLightDamping);
  const ComplexMatrix exact = TransferFunction(bench.whole)(kNarrowShift);
  const ComplexMatrix reduced = TransferFunction(bench.projected(bench.chosen(bench.ports())))(kNarrowShift);
  CHECK((reduced - exact).norm() < 1e-7 * exact.norm());
}

TEST_CASE("On a lightly damped body chosen modes follow a hand closer than as many Krylov directions") {
  const Grasped bench(kLightDamping);
  const std::vector<Vector> ports = bench.ports();
  const double plain = error(bench.whole, bench.projected(bench.krylov(kModes, ports)));
  const double chosen = error(bench.whole, bench.projected(bench.chosen(ports)));
  CAPTURE(plain, chosen);
  CHECK(chosen < 0.5 * plain);
}

TEST_CASE("Chosen modes are passive: no damping and no stiffness below zero") {
  const Grasped bench(kLightDamping);
  const SecondOrderSystem reduced = bench.projected(bench.chosen(bench.ports()));
  for (const SparseMatrix& m : {reduced.damping, reduced.stiffness})
    CHECK(Eigen::SelfAdjointEigenSolver<Matrix>(Matrix(m)).eigenvalues()[0] > 0);
}

TEST_CASE("A patch with few modes and long to last has chosen modes, to the last bit the same ones every time") {
  constexpr int kSmallEnoughToFactorise = 4;  // exact solves
  Grasped bench(kLightDamping, kSmallEnoughToFactorise);
  PatchBuilder builder(bench.dynamics, bench.skin, 0), again(bench.dynamics, bench.skin, 0);
  const Patch patch = bench.patch(builder), other = bench.patch(again);
  CHECK(check(patch) == PatchFault::none);
  const Matrix k = bench.projected(bench.chosen(bench.ports())).stiffness;
  const Vector expected = Eigen::SelfAdjointEigenSolver<Matrix>(k).eigenvalues();
  CHECK((patch.stiffness - expected).norm() < 1e-6 * expected.norm());
  CHECK(patch.stiffness == other.stiffness);
  CHECK(patch.b_k == other.b_k);
}

TEST_CASE("Chosen modes start from the responses of the frame before") {
  constexpr int kTooLargeToFactorise = 11;
  Grasped bench(kLightDamping, kTooLargeToFactorise);
  PatchBuilder builder(bench.dynamics, bench.skin, 0);
  const Patch first = bench.patch(builder);
  const int cold = builder.report().solver_iterations;
  CAPTURE(cold);
  const Patch second = bench.patch(builder);
  CHECK(builder.report().solver_iterations < cold / 2);
  CHECK((first.stiffness - second.stiffness).norm() < 0.05 * first.stiffness.norm());
}
