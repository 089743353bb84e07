// Patches against dense linear algebra on the whole body: properties that a reduction must keep.
#include "server/reduction/patch_build.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <unsupported/Eigen/MatrixFunctions>

#include "common/player/player.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/eigenvalues.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kBuilderHorizon{100'000};
constexpr double kBuilderShift = 20;  // 2 / horizon

struct BuilderBench {
  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  BodyState state;
  std::vector<ToolPort> ports{1};
  PatchRequest request;
  ToolAt tool_at;

  BuilderBench(LumpedBody b, ContactKind kind, double shift_m, double speed_m_s)
      : body(std::move(b)), state(random_state(dynamics, 5, shift_m, speed_m_s)) {
    ports[0].kind = kind;
    ports[0].parameters = {1000, 0.3};
    request.horizon = kBuilderHorizon;
  }
  BuilderBench& attach(std::uint32_t node) {
    ports[0].node = node;
    ports[0].lambda = -dynamics.element_force(state, node);
    tool_at = {node_of(state.x, node), node_of(state.v, node)};
    return *this;
  }
  BuilderBench& touch(std::uint32_t triangle, const Vec3& weight) {
    ports[0].point = {triangle, weight};
    const Positions x(state.x.data(), static_cast<std::size_t>(state.x.size()));
    tool_at.position = position_at(skin.view(), x, ports[0].point) + 0.001 * normal_at(skin.view(), x, ports[0].point);
    return *this;
  }
  Patch build(Scheme scheme, int order = 0) { return built(scheme, order).patch; }
  BuiltPatch built(Scheme scheme, int order = 0) {
    request.scheme = scheme;
    request.order = order;
    FrameModel frame(dynamics, skin, 0);
    frame.begin(state, ports, std::span(&tool_at, 1), request.horizon);
    auto made = build_patch(frame, 0, request);
    REQUIRE(made);
    REQUIRE(check(made->patch) == PatchFault::none);
    return *made;
  }

  /// Free degrees of freedom without the tool's node.
  std::vector<Eigen::Index> free() const {
    std::vector<Eigen::Index> index;
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
      if (!body.fixed[i] && (ports[0].kind == ContactKind::touch || i != ports[0].node))
        for (int axis = 0; axis < 3; ++axis) index.push_back(3 * static_cast<Eigen::Index>(i) + axis);
    return index;
  }
  std::vector<Eigen::Index> tool() const {
    const auto first = 3 * static_cast<Eigen::Index>(ports[0].node);
    return {first, first + 1, first + 2};
  }
  /// Columns of B on the free degrees of freedom.
  Matrix contact_input() const {
    Matrix b = Matrix::Zero(state.x.size(), 3);
    const Triangle& t = skin.view().triangles[ports[0].point.triangle];
    for (int k = 0; k < 3; ++k)
      b.middleRows<3>(3 * static_cast<Eigen::Index>(t[static_cast<std::size_t>(k)])) +=
          ports[0].point.weight[k] * Mat3::Identity();
    return b(free(), Eigen::all);
  }
};

/// Dense blocks of the linearised body, f free and t the tool's node.
struct Dense {
  std::vector<Eigen::Index> f, t;
  Matrix k, d;
  Vector m;

  explicit Dense(const BuilderBench& bench)
      : f(bench.free()),
        t(bench.tool()),
        k(dense_stiffness(bench.dynamics, bench.state)),
        d(dense_damping(bench.dynamics, bench.state)),
        m(bench.dynamics.masses()) {}
  Matrix dynamic(double s) const {
    Matrix p = k(f, f) + s * d(f, f);
    p.diagonal() += s * s * m(f);
    return p;
  }
  /// Force of the tool per displacement of the node, without the node's own mass.
  Mat3 stiffness_at(double s) const {
    const Matrix port = k(f, t) + s * d(f, t);
    return k(t, t) + s * d(t, t) - port.transpose() * dynamic(s).lu().solve(port);
  }
};

Mat3 stiffness_at(const Patch& p, double s) {
  Matrix dynamic = s * Matrix(p.damping);
  dynamic.diagonal() += p.stiffness + s * s * ModeVector::Ones(p.modes());
  const Matrix port = Matrix(p.b_k) + s * Matrix(p.b_d);
  return p.k_port + s * p.d_port - port.transpose() * dynamic.lu().solve(port);
}

}  // namespace

TEST_CASE("A Krylov basis is orthonormal in the mass matrix and leaves held nodes alone") {
  const BuilderBench bench(box_body(4, 4, 4), ContactKind::attach, 0.001, 0.05);
  auto held = bench.body.fixed;
  held[54] = 1;
  const WholeBody whole(bench.dynamics, bench.state);
  const Linearisation at(whole, held);
  ShiftedSolver solver(bench.dynamics);
  REQUIRE(solver.prepare(at, kBuilderShift, false));
  std::vector<Vector> inputs;
  for (int axis = 0; axis < 3; ++axis) inputs.push_back(Vector::Unit(bench.state.x.size(), 3 * 53 + axis));
  Vector residual;
  bench.dynamics.forces(bench.state.x, bench.state.v, residual);
  const auto directions = [&](const std::vector<Vector>& ports, const Vector& own, int modes) {
    const KrylovSolve solve = [&](std::span<const SolveColumn> columns) { return solver.solve(at, columns, 1e-8); };
    KrylovStart start;
    start.ports.resize(ports.size());
    for (std::size_t k = 0; k < ports.size(); ++k) REQUIRE(solver.solve(at, ports[k], 1e-8, start.ports[k]));
    REQUIRE(solver.solve(at, own, 1e-8, start.residual));
    REQUIRE(solver.solve(at, at.free_momentum(), 1e-8, start.motion));
    return krylov_basis(at, start, solve, {modes, kBuilderShift});
  };
  const auto basis = directions(inputs, residual, kMaxModes);
  REQUIRE(basis);
  const Matrix& v = *basis;
  CHECK(v.cols() == kMaxModes);
  CHECK((v.transpose() * bench.dynamics.masses().asDiagonal() * v - Matrix::Identity(v.cols(), v.cols())).norm() < 1e-12);
  for (std::uint32_t i = 0; i < held.size(); ++i)
    if (held[i]) CHECK(v.middleRows<3>(3 * static_cast<Eigen::Index>(i)).norm() == 0);

  // A repeated direction adds nothing.
  inputs.push_back(inputs[0] + inputs[1]);
  const auto repeated = directions(inputs, Vector::Zero(residual.size()), 4);
  REQUIRE(repeated);
  const Matrix& w = *repeated;
  CHECK((w.leftCols(3) - v.leftCols(3)).norm() < 1e-6 * w.norm());
}

TEST_CASE("The reduced grasp responds as the whole body at the matched frequency, to its first derivative") {
  BuilderBench bench(box_body(4, 4, 4), ContactKind::attach, 0.0005, 0.05);
  bench.attach(54);
  const Patch patch = bench.build(Scheme::port);
  const Dense whole(bench);
  const Mat3 exact = whole.stiffness_at(kBuilderShift);
  CHECK((stiffness_at(patch, kBuilderShift) - exact).norm() < 1e-8 * exact.norm());
  constexpr double kStep = 0.01;
  const Mat3 slope = (whole.stiffness_at(kBuilderShift + kStep) - whole.stiffness_at(kBuilderShift - kStep)) / (2 * kStep);
  const Mat3 reduced = (stiffness_at(patch, kBuilderShift + kStep) - stiffness_at(patch, kBuilderShift - kStep)) / (2 * kStep);
  CHECK((reduced - slope).norm() < 1e-5 * slope.norm());
}

TEST_CASE("A grasp patch of full order plays what the dense linear model of the whole body does") {
  BuilderBench bench(box_body(2, 2, 2), ContactKind::attach, 0.001, 0.05);
  bench.attach(7);
  const Patch patch = bench.build(Scheme::port, 2 * kMaxModes);
  REQUIRE(patch.modes() == 9);
  const Dense whole(bench);
  const auto n = static_cast<Eigen::Index>(whole.f.size());
  Vector f_star;
  bench.dynamics.forces(bench.state.x, bench.state.v, f_star);
  const Vector v_star = bench.state.v(whole.f);
  const Vec3 tool_velocity = bench.tool_at.velocity;

  // State (y, y', d, u, 1): u is the tool's velocity, constant inside a tick; M y'' = F* + D v* - K y - D y' - K_ft d - D_ft (u -
  // h'*).
  const Eigen::Index size = 2 * n + 7;
  const Matrix inverse_mass = whole.m(whole.f).cwiseInverse().asDiagonal();
  Matrix a = Matrix::Zero(size, size);
  a.block(0, n, n, n).setIdentity();
  a.block(n, 0, n, n) = -inverse_mass * whole.k(whole.f, whole.f);
  a.block(n, n, n, n) = -inverse_mass * whole.d(whole.f, whole.f);
  a.block(n, 2 * n, n, 3) = -inverse_mass * whole.k(whole.f, whole.t);
  a.block(n, 2 * n + 3, n, 3) = -inverse_mass * whole.d(whole.f, whole.t);
  a.block(n, 2 * n + 6, n, 1) =
      inverse_mass * (f_star(whole.f) + whole.d(whole.f, whole.f) * v_star + whole.d(whole.f, whole.t) * tool_velocity);
  a.block(2 * n, 2 * n + 3, 3, 3).setIdentity();
  const Matrix tick = (1e-3 * a).exp();

  Vector z = Vector::Zero(size);
  z.segment(n, n) = v_star;
  z[size - 1] = 1;
  PatchPlayer player(patch);
  Random random(11);
  Vec3 tool = bench.tool_at.position;
  double worst = 0, largest = 0;
  for (int ms = 1; ms <= 300; ++ms) {
    const Vec3 next = bench.tool_at.position + 0.004 * Vec3(std::sin(0.02 * ms), std::sin(0.03 * ms), -std::sin(0.05 * ms)) +
                      random_vector(random, 1e-5);
    z.segment<3>(2 * n + 3) = (next - tool) / 1e-3;
    z = tick * z;
    const Vec3 rate = (next - tool) / 1e-3 - tool_velocity;
    const Vec3 exact = bench.dynamics.element_force(bench.state, 7) - whole.k(whole.t, whole.t) * z.segment<3>(2 * n) -
                       whole.d(whole.t, whole.t) * rate - whole.k(whole.t, whole.f) * z.head(n) -
                       whole.d(whole.t, whole.f) * (z.segment(n, n) - v_star);
    const Vec3 played = player.advance({Micros{1000 * ms}, next}).force;
    worst = std::max(worst, (played - exact).norm());
    largest = std::max(largest, exact.norm());
    tool = next;
  }
  CHECK(worst < 1e-6 * largest);
}

TEST_CASE("A grasp patch is passive even where the compressed body is not") {
  const auto scheme = GENERATE(Scheme::port, Scheme::ring, Scheme::tangent, Scheme::hyper);
  int projected = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    BuilderBench bench(box_body(4, 4, 4), ContactKind::attach, 0, 0);
    bench.state = random_state(bench.dynamics, seed, 0.016, 0.1);
    bench.attach(54);
    const BuiltPatch built = bench.built(scheme);  // calls check()
    projected += built.psd_change_1_s2 > 0;
    CHECK(built.patch.damping.allFinite());
  }
  CHECK(projected > 0);
}

TEST_CASE("K is diagonal, ascending and not negative, D is symmetric and not negative, for every scheme with modes") {
  const auto scheme = GENERATE(Scheme::port, Scheme::ring);
  const auto kind = GENERATE(ContactKind::attach, ContactKind::touch);
  const double shift_m = GENERATE(0.0, 0.001, 0.004);
  BuilderBench bench(box_body(4, 4, 4), kind, shift_m, 0.1);
  bench.attach(54).touch(20, Vec3(0.3, 0.3, 0.4));
  const Patch patch = bench.build(scheme);
  CHECK(patch.modes() == (kind == ContactKind::attach ? 11 : kMaxModes));
  CHECK(patch.stiffness.minCoeff() >= 0);
  for (int i = 1; i < patch.modes(); ++i) CHECK(patch.stiffness[i] >= patch.stiffness[i - 1]);
  CHECK((patch.damping - patch.damping.transpose()).norm() == 0);
  CHECK(test::symmetric_eigenvalues(Matrix(patch.damping))[0] > -1e-9 * patch.damping.norm());
}

TEST_CASE("tangent is the Schur complement of the dense stiffness at the tool, or the dense compliance at the point") {
  BuilderBench bench(box_body(4, 4, 4), ContactKind::attach, 0.0005, 0.05);
  bench.attach(54);
  const Patch grasp = bench.build(Scheme::tangent);
  const Mat3 schur = Dense(bench).stiffness_at(0);
  CHECK(grasp.modes() == 0);
  CHECK((grasp.k_port - schur).norm() < 1e-8 * schur.norm());
  CHECK(grasp.d_port.norm() == 0);

  BuilderBench pressed(box_body(4, 4, 4), ContactKind::touch, 0.0005, 0.05);
  const auto top = static_cast<std::uint32_t>(pressed.body.triangles.size()) - 9;
  pressed.touch(top, Vec3(0.2, 0.5, 0.3));
  const Matrix b = pressed.contact_input();
  const Mat3 compliance = b.transpose() * Dense(pressed).dynamic(0).lu().solve(b);
  CHECK((pressed.build(Scheme::tangent).c_static - compliance).norm() < 1e-8 * compliance.norm());
}

TEST_CASE("ring holds the far nodes and is therefore stiffer than the body in every direction") {
  BuilderBench bench(box_body(5, 5, 5), ContactKind::attach, 0, 0);
  bench.attach(112);
  const Mat3 body = Dense(bench).stiffness_at(0), ring = stiffness_at(bench.build(Scheme::ring, 32), 0);
  CHECK(test::symmetric_eigenvalues(ring - body)[0] > 0.1 * body.norm());
  const Mat3 port = stiffness_at(bench.build(Scheme::port, 32), 0);
  CHECK((port - body).norm() < 0.01 * body.norm());
}

TEST_CASE(
    "A touch patch carries the body's surface at the stamp, moves it as the body moves, and yields as the body at the matched "
    "frequency") {
  BuilderBench bench(box_body(4, 4, 4), ContactKind::touch, 0.0005, 0.05);
  const auto top = static_cast<std::uint32_t>(bench.body.triangles.size()) - 9;
  bench.touch(top, Vec3(0.2, 0.5, 0.3));
  const Patch patch = bench.build(Scheme::port, 2 * kMaxModes);
  REQUIRE(patch.surface.vertex_count >= 6);
  for (int i = 0; i < patch.surface.vertex_count; ++i) {
    const PortVertex& vertex = patch.surface.vertices[static_cast<std::size_t>(i)];
    bool found = false;
    for (std::uint32_t node = 0; node < bench.dynamics.nodes(); ++node) {
      if ((node_of(bench.state.x, node) - vertex.position).norm() > 1e-12) continue;
      found = true;
      // The body's own motion lies in the basis, so the rows give every vertex its velocity.
      CHECK((vertex.rows * patch.q_rate - node_of(bench.state.v, node)).norm() < 1e-8);
    }
    CHECK(found);
  }
  CHECK(patch.point.triangle == 0);
  CHECK(patch.point.weight == bench.ports[0].point.weight);
  PortRows rows = PortRows::Zero(3, patch.modes());
  for (int k = 0; k < 3; ++k)
    rows += patch.point.weight[k] * patch.surface.vertices[patch.surface.triangles[0][static_cast<std::size_t>(k)]].rows;
  Matrix dynamic = kBuilderShift * Matrix(patch.damping);
  dynamic.diagonal() += patch.stiffness + kBuilderShift * kBuilderShift * ModeVector::Ones(patch.modes());
  const Matrix b = bench.contact_input();
  const Mat3 exact = b.transpose() * Dense(bench).dynamic(kBuilderShift).lu().solve(b);
  CHECK((Matrix(rows) * dynamic.lu().solve(Matrix(rows).transpose()) - exact).norm() < 1e-8 * exact.norm());
}

TEST_CASE("hold shows the force at the stamp and nothing else") {
  BuilderBench bench(box_body(3, 3, 3), ContactKind::attach, 0.001, 0.05);
  bench.attach(22);
  const Patch hold = bench.build(Scheme::hold);
  CHECK(hold.constant);
  CHECK(hold.modes() == 0);
  CHECK((hold.force - bench.dynamics.element_force(bench.state, 22)).norm() < 1e-15);
  CHECK(hold.valid_for > kBuilderHorizon);
  CHECK(hold.trust_radius_m > 0);
}

TEST_CASE("The softest stiffness is the lowest eigenvalue of the body at rest, and 0 for one that hangs on nothing", "[reduce]") {
  LumpedBody body = box_body(4, 4, 5);
  const Dynamics dynamics(body);
  const BodyState rest = dynamics.rest_state();
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < rest.x.size(); ++i)
    if (!body.fixed[static_cast<std::size_t>(i / 3)]) rows.push_back(i);
  Matrix k(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.size()));
  for (Eigen::Index c = 0; c < k.cols(); ++c) {
    Vector y = Vector::Zero(rest.x.size()), k_y, d_y;
    y[rows[static_cast<std::size_t>(c)]] = 1;
    dynamics.multiply_tangents(rest, y, k_y, d_y);
    for (Eigen::Index r = 0; r < k.rows(); ++r) k(r, c) = k_y[rows[static_cast<std::size_t>(r)]] / body.masses_kg[0];
  }
  const double lowest = test::symmetric_eigenvalues(k)[0];
  const double softest = softest_stiffness(dynamics);
  CHECK(softest >= lowest * (1 - 1e-9));
  CHECK(softest <= lowest * 1.05);

  std::fill(body.fixed.begin(), body.fixed.end(), std::uint8_t{0});
  CHECK(softest_stiffness(dynamics) == 0);
}

TEST_CASE("No mode of a touch patch is softer than it is told, however the body is compressed", "[reduce]") {
  for (const double floor_1_s2 : {0.0, 400.0, 2000.0}) {
    BuilderBench bench(box_body(4, 4, 4), ContactKind::touch, 0.009, 0.1);
    bench.touch(40, Vec3(0.3, 0.3, 0.4));
    bench.request.scheme = Scheme::port;
    FrameModel frame(bench.dynamics, bench.skin, floor_1_s2);
    frame.begin(bench.state, bench.ports, std::span(&bench.tool_at, 1), bench.request.horizon);
    const auto built = build_patch(frame, 0, bench.request);
    REQUIRE(built);
    REQUIRE(built->patch.modes() > 0);
    CHECK(built->patch.stiffness.minCoeff() >= floor_1_s2);
    CHECK(check(built->patch) == PatchFault::none);
  }
}
