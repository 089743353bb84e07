// A body that is fine around the tools and coarse elsewhere, against the whole body.
#include "server/operators/refined_body.hpp"

#include <Eigen/SparseCholesky>
#include <catch2/catch.hpp>

#include "server/reduction/patch_build.hpp"
#include "tests/support/eigenvalues.hpp"
#include "tests/support/large_body.hpp"
#include "tests/support/rigid_parts.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

LumpedBody loose_body(Filling filling) {
  LumpedBody body = large_body(filling);
  body.fixed.assign(body.fixed.size(), 0);
  return body;
}

struct RefinedBench {
  LumpedBody body;
  Dynamics dynamics{body};
  RefinedBody refined{dynamics};
  BodyState state = dynamics.rest_state();

  explicit RefinedBench(LumpedBody b = large_body()) : body(std::move(b)) {}
  explicit RefinedBench(Filling filling) : RefinedBench(large_body(filling)) {}
  /// Repeats until no cell is behind.
  void settle() {
    for (int k = 0; k < 40; ++k) refined.take(state);
  }
  /// Deforms and rotates the whole body smoothly.
  void bend(double by) {
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
      const Vec3 x = body.nodes[i];
      at_node(state.x, i) += by * Vec3(x.z() * x.z(), 0.5 * x.x() * x.z(), -x.x() * x.y());
      at_node(state.v, i) = Vec3(x.z(), 0.2 * x.y(), -x.x());
    }
  }
  Vector random(Eigen::Index size, std::uint64_t seed) const {
    Random random(seed);
    Vector y(size);
    for (double& value : y) value = random.uniform(-1, 1);
    return y;
  }
};

Filling any_filling() { return GENERATE(Filling::springs, Filling::neo_hookean, Filling::corotational, Filling::hexahedra); }

/// T^T f, node by node.
Vector gathered(const RefinedBody& refined, const Vector& f) {
  Vector y = Vector::Zero(refined.masses().size());
  for (std::uint32_t i = 0; i < refined.dynamics().nodes(); ++i)
    for (const auto& [row, weight] : refined.restricted(NodeWeights{{i, 1.0}})) at_node(y, row) += weight * at_node(f, i);
  return y;
}

/// Product A x with a symmetric matrix stored as its upper triangle.
Vector product_of_upper(const BlockMatrix& a, const Vector& x) {
  Vector y = Vector::Zero(x.size());
  for (std::uint32_t row = 0; row < a.rows(); ++row)
    for (std::uint32_t e = a.row_begin(row); e < a.row_end(row); ++e) {
      at_node(y, row) += a.block(e) * at_node(x, a.column(e));
      if (a.column(e) != row) at_node(y, a.column(e)) += a.block(e).transpose() * at_node(x, row);
    }
  return y;
}

}  // namespace

TEST_CASE(
    "A locally refined body has the fewer coordinates the further its nodes are from the tools, and those of near ones are "
    "theirs") {
  RefinedBench bench;
  focus_on(bench.refined, kTop);
  CHECK(bench.refined.size() < bench.dynamics.nodes() / 3);
  CHECK(bench.refined.coordinate(kTop) != RefinedBody::kNone);
  CHECK(bench.refined.coordinate(0) == RefinedBody::kNone);
  bench.refined.take(bench.state);
  CHECK(bench.refined.masses().sum() ==
        Approx(bench.dynamics.masses().sum() * (kLargeEdge - 1.0) / kLargeEdge).epsilon(0.02));  // without fixed and far nodes
}

TEST_CASE("What acts on a locally refined body is what acts on its nodes: no work is made or lost") {
  RefinedBench bench(any_filling());
  focus_on(bench.refined, kTop);
  bench.bend(0.3);
  bench.refined.take(bench.state);
  const Eigen::Index size = bench.refined.masses().size();
  const Vector y = bench.random(size, 1), moved = bench.random(bench.state.x.size(), 2);
  CHECK(bench.refined.masses().cwiseProduct(bench.refined.displacement(bench.state.x, bench.state.x + moved)).dot(y) ==
        Approx(bench.dynamics.masses().cwiseProduct(moved).dot(moved_by(bench.refined, y))).epsilon(1e-12));
  const Vector momentum = bench.dynamics.masses().cwiseProduct(bench.state.v);
  CHECK(bench.refined.masses().cwiseProduct(bench.refined.velocity()).dot(y) ==
        Approx(momentum.dot(moved_by(bench.refined, y))).epsilon(1e-12));
  Vector exact;
  bench.dynamics.forces(bench.state.x, bench.state.v, exact);
  const Vector& forces = bench.refined.forces();
  CHECK((forces - gathered(bench.refined, exact)).norm() < 1e-5 * forces.norm());
}

TEST_CASE("A motion that is the same everywhere in a locally refined body costs what it costs in the whole one") {
  RefinedBench bench(loose_body(any_filling()));
  focus_on(bench.refined, kTop);
  bench.bend(0.2);
  bench.settle();
  // An affine motion in the coordinates: near nodes at their places, corners at theirs, by least squares from the nodes.
  Mat3 gradient;
  gradient << 0.3, -0.2, 0.5, 0.1, 0.7, -0.4, 0.2, 0.3, -0.6;
  Vector x(bench.state.x.size());
  for (std::uint32_t i = 0; i < bench.dynamics.nodes(); ++i) at_node(x, i) = gradient * bench.body.nodes[i] + Vec3(0.1, 0.2, 0.3);
  const Eigen::Index size = bench.refined.masses().size();
  Eigen::SparseMatrix<double> t(x.size(), size);
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<NodeWeights> of_node;
  for (std::uint32_t i = 0; i < bench.dynamics.nodes(); ++i) of_node.push_back(bench.refined.restricted(NodeWeights{{i, 1.0}}));
  for (std::uint32_t i = 0; i < of_node.size(); ++i)
    for (const auto& [row, weight] : of_node[i])
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        entries.emplace_back(static_cast<int>(3 * i + axis), static_cast<int>(3 * row + axis), weight);
  t.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> normal(t.transpose() * t);
  const Vector y = normal.solve(t.transpose() * x);
  REQUIRE((t * y - x).norm() < 1e-9 * x.norm());

  Matrix k_y, d_y;
  bench.refined.multiply(y, k_y, d_y);
  Vector k_x, d_x;
  bench.dynamics.multiply_tangents(bench.state, x, k_x, d_x);
  CHECK(y.dot(k_y.col(0)) == Approx(x.dot(k_x)).epsilon(2e-3));  // far tangents are kept until their cell has deformed by 0.002
  CHECK(y.dot(d_y.col(0)) == Approx(x.dot(d_x)).epsilon(2e-3));
}

TEST_CASE("Products with the tangents of a locally refined body are those with the matrix that is put together") {
  RefinedBench bench(any_filling());
  focus_on(bench.refined, kTop);
  bench.bend(0.5);
  bench.settle();
  const std::vector<std::uint8_t> none(bench.refined.size(), 0);
  BlockMatrix a = bench.refined.make_matrix();
  bench.refined.assemble(0, 0.3, 0.7, none, false, a);
  const Vector y = bench.random(bench.refined.masses().size(), 5), a_y = product_of_upper(a, y);
  Matrix k_y, d_y, sum;
  bench.refined.multiply(y, k_y, d_y);
  bench.refined.multiply_sum(y, 0.7, 0.3, sum);
  CHECK((0.7 * k_y + 0.3 * d_y - a_y).norm() < 1e-12 * a_y.norm());
  CHECK((sum - a_y).norm() < 1e-12 * a_y.norm());
}

TEST_CASE("Far tetrahedra are renewed until none is behind, and then are those of the state") {
  RefinedBench bench(Filling::neo_hookean);
  focus_on(bench.refined, kTop);
  RefinedBody fresh(bench.dynamics);
  focus_on(fresh, kTop);
  bench.bend(1.0);
  bench.settle();
  // The same independently: every tetrahedron's energy, to second order, along a random motion of the coordinates. Tetrahedra
  // between cells move like one of the cells, extrapolated, so the motion must be equal in all: affine.
  Vector y(bench.refined.masses().size());
  Random random(7);
  Mat3 gradient;
  for (int k = 0; k < 9; ++k) gradient(k / 3, k % 3) = random.uniform(-1, 1);
  std::array<RefinedBody::Share, FarField::kCorners> room;
  for (std::uint32_t c = 0; c < bench.refined.far().cells(); ++c) {
    if (bench.refined.near()[c]) continue;
    for (std::size_t k = 0; k < FarField::kCorners; ++k)
      at_node(y, bench.refined.corner(bench.refined.far().corners_of(c)[k])) = gradient * bench.refined.far().corner(c, k);
  }
  for (std::uint32_t i = 0; i < bench.dynamics.nodes(); ++i)
    if (bench.refined.coordinate(i) != RefinedBody::kNone)
      at_node(y, bench.refined.shares(i, room)[0].coordinate) = gradient * bench.body.nodes[i];
  Matrix before, after, d_y;
  fresh.take(bench.state);  // some far ones are still those at rest
  fresh.multiply(y, before, d_y);
  bench.refined.multiply(y, after, d_y);
  Vector x(bench.state.x.size()), k_x, d_x;
  for (std::uint32_t i = 0; i < bench.dynamics.nodes(); ++i)
    at_node(x, i) = bench.body.fixed[i] ? Vec3::Zero() : Vec3(gradient * bench.body.nodes[i]);
  bench.dynamics.multiply_tangents(bench.state, x, k_x, d_x);
  const double exact = x.dot(k_x);
  CHECK(std::abs(y.dot(after.col(0)) - exact) < 5e-3 * exact);
  CHECK(std::abs(y.dot(before.col(0)) - exact) > 2 * std::abs(y.dot(after.col(0)) - exact));
}

TEST_CASE("A refined body that is near everywhere is the whole body, its rows in another order") {
  RefinedBench bench(any_filling());
  std::vector<std::uint32_t> all(bench.dynamics.nodes());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  bench.refined.focus(bench.body.nodes, all);
  REQUIRE(bench.refined.size() == bench.dynamics.nodes());
  bench.bend(-1.5);  // many springs are compressed, and some tetrahedra inside out
  bench.refined.take(bench.state);
  const bool clamp = GENERATE(false, true);
  std::vector<std::uint8_t> held = bench.body.fixed, held_there(bench.refined.size());
  held[kTop] = 1;
  for (std::uint32_t i = 0; i < all.size(); ++i) held_there[bench.refined.coordinate(i)] = held[i];
  BlockMatrix a = bench.dynamics.make_matrix(), there = bench.refined.make_matrix();
  bench.dynamics.assemble(bench.state, 400, 20, 1, held, clamp, a);
  bench.refined.assemble(400, 20, 1, held_there, clamp, there);
  const Vector x = bench.random(bench.state.x.size(), 3);
  Vector y(x.size()), a_x;
  for (std::uint32_t i = 0; i < all.size(); ++i) at_node(y, bench.refined.coordinate(i)) = at_node(x, i);
  a.multiply(x, a_x);
  const Vector a_y = product_of_upper(there, y);
  double worst = 0;
  for (std::uint32_t i = 0; i < all.size(); ++i)
    worst = std::max(worst, (at_node(a_y, bench.refined.coordinate(i)) - at_node(a_x, i)).norm());
  CHECK(worst < 1e-12 * a_x.cwiseAbs().maxCoeff());
}

TEST_CASE("A tool that slides changes the coordinates of a locally refined body now and then, and is always among the near") {
  RefinedBench bench;
  std::uint64_t generation = 0;
  int changes = 0;
  constexpr int kSteps = 40;
  for (int step = 0; step < kSteps; ++step) {
    const Vec3 place = bench.body.nodes[kTop] + Vec3(0.05 * (step / (kSteps - 1.0) - 0.5), 0, 0);
    const std::uint32_t node = kTop + static_cast<std::uint32_t>(step * 3 / kSteps);
    bench.refined.focus(std::span(&place, 1), std::span(&node, 1));
    changes += bench.refined.generation() != generation;
    generation = bench.refined.generation();
    CHECK(bench.refined.coordinate(node) != RefinedBody::kNone);
    CHECK(bench.refined.size() < bench.dynamics.nodes() / 2);
  }
  CHECK(changes > 1);
  CHECK(changes < kSteps / 4);
}

TEST_CASE("The port of a locally refined body is as soft as that of the whole to two per cent, and never softer") {
  const bool bent = GENERATE(false, true);
  RefinedBench bench(any_filling());
  if (bent) bench.bend(0.3);
  const Skin skin(bench.body);
  FrameModel frame(bench.dynamics, skin, 0);
  ToolPort port;
  port.parameters = {800, 0.3};
  port.touching = true;
  for (std::uint32_t t = 0; t < bench.body.triangles.size(); ++t)
    if (bench.body.triangles[t][0] == kTop) port.point = {t, Vec3(0.4, 0.4, 0.2)};
  port.lambda = Vec3(0, 0, -0.2);
  const std::vector<ToolPort> ports{port};
  const ToolAt tool{position_at(skin.view(), skin.place(bench.state.x), port.point), Vec3::Zero()};
  REQUIRE(&frame.refined() != &frame.whole());
  constexpr double kShift = 15;
  // Twice: the second time the far tangents are closer to the state.
  Mat3 compliance[2];
  for (BodyFrame* model : {&frame.refined(), &frame.whole()}) {
    for (int frames = 0; frames < 10; ++frames) {
      frame.begin(bench.state, ports, std::span(&tool, 1), Micros{150'000});
      SharedSystem* const p = model->system({kShift, false, model->held()}, 1e-5);
      REQUIRE(p);
      REQUIRE(model->respond(*p, 0, true));
      compliance[model == &frame.whole()] = p->port(0).compliance;
    }
  }
  INFO("refined\n" << compliance[0] << "\nwhole\n" << compliance[1]);
  const Mat3 softer = compliance[1] - compliance[0];
  const double softest = test::symmetric_eigenvalues(0.5 * (softer + softer.transpose())).minCoeff();
  CHECK(softer.norm() < 0.02 * compliance[1].norm());
  // Far tangents of a deformed body are kept slightly beyond their accuracy. The shapes of a cell are extrapolated for nodes of
  // an element in the next cell, by more if it has eight.
  const double continued = bench.body.hexahedra.empty() ? 1e-4 : 2e-3;
  if (!bent) CHECK(softest > -continued * compliance[1].norm());
}

TEST_CASE("A coarse space of the whole body solves what is smooth in a locally refined one") {
  RefinedBench bench;
  focus_on(bench.refined, kTop);
  bench.refined.take(bench.state);
  const std::vector<std::uint8_t>& held = bench.refined.fixed();
  BlockMatrix a = bench.refined.make_matrix();
  constexpr double kShift = 5;
  bench.refined.assemble(kShift * kShift, kShift, 1, held, false, a);
  Vector b = Vector::Zero(bench.refined.masses().size());
  at_node(b, bench.refined.coordinate(kTop)) = Vec3(0, 0.3, -1);
  Vector x[2];
  int iterations[2];
  for (const bool coarsely : {false, true}) {
    BatchConjugateGradients solver;
    solver.prepare(a, held,
                   {coarsely ? bench.refined.coarse()->inverse(kShift * kShift, kShift) : nullptr, bench.refined.pieces()});
    const SolveColumn column{&b, &x[coarsely]};
    bool definite = true;
    iterations[coarsely] = solver.solve(std::span(&column, 1), 1e-4, definite);
    CHECK(definite);
  }
  CHECK((x[1] - x[0]).norm() < 2e-3 * x[0].norm());
  CHECK(iterations[1] < 0.7 * iterations[0]);
}

TEST_CASE(
    "The patch of a grasped node of a large body is as stiff as the whole body there, to two per cent, and a ring's exactly") {
  RefinedBench bench(any_filling());
  bench.bend(0.2);
  const Skin skin;
  FrameModel frame(bench.dynamics, skin, 0);
  const std::vector<ToolPort> ports = grasped_top();
  const ToolAt tool{at_node(bench.state.x, kTop), at_node(bench.state.v, kTop)};
  PatchRequest request;
  request.scheme = GENERATE(Scheme::port, Scheme::tangent, Scheme::ring);
  request.horizon = Micros{100'000};
  std::optional<Patch> patch;
  for (int frames = 0; frames < 10; ++frames) {
    frame.begin(bench.state, ports, std::span(&tool, 1), request.horizon);
    if (const auto built = build_patch(frame, 0, request)) patch = built->patch;
  }
  REQUIRE(patch);
  REQUIRE(check(*patch) == PatchFault::none);

  const double shift = request.scheme == Scheme::tangent ? 0 : 20;  // 2 / horizon
  std::vector<std::uint8_t> held = bench.body.fixed;
  if (request.scheme == Scheme::ring) {
    held.assign(held.size(), 1);
    for (const auto& [a, b] : edges_of(bench.body))
      if (a == kTop || b == kTop) held[a] = held[b] = 0;
  }
  held[kTop] = 1;
  const WholeBody body(bench.dynamics, bench.state);
  const Linearisation at(body, held);
  ShiftedSolver solver(bench.dynamics);
  REQUIRE(solver.prepare(at, shift, false));
  Mat3 whole;
  std::array<Vector, 3> b, x;
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    Vector d_b;
    bench.dynamics.multiply_tangents(bench.state, Vector::Unit(bench.state.x.size(), 3 * Eigen::Index{kTop} + axis), b[k], d_b);
    b[k] += shift * d_b;
    whole.col(axis) = at_node(b[k], kTop);
    mask(held, b[k]);
    REQUIRE(solver.solve(at, b[k], 1e-5, x[k]));
  }
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) whole(static_cast<int>(i), static_cast<int>(j)) -= b[i].dot(x[j]);

  Mat3 reduced = patch->k_port + shift * patch->d_port;
  if (patch->modes() > 0) {
    Matrix dynamic = shift * Matrix(patch->damping);
    dynamic.diagonal() += Vector(patch->stiffness) + Vector::Constant(patch->modes(), shift * shift);
    const Matrix rows = Matrix(patch->b_k) + shift * Matrix(patch->b_d);
    reduced -= rows.transpose() * dynamic.ldlt().solve(rows);
  }
  INFO("reduced\n" << reduced << "\nwhole\n" << whole);
  CHECK((reduced - whole).norm() < (request.scheme == Scheme::ring ? 1e-3 : 0.02) * whole.norm());
}

TEST_CASE("Contacts with a rigid part have their tangents and forces in the coordinates of a refined body") {
  LumpedBody body = large_body(Filling::hexahedra);
  const double side = kSpacingM * (kLargeEdge - 1);
  body.parts = {rigid_box(Vec3(side - 0.001, -0.1, -0.1), Vec3(side + 0.1, side + 0.1, side + 0.1), 0.4)};
  LumpedBody alone = body;
  alone.parts.clear();
  RefinedBench with(std::move(body)), without(std::move(alone));
  for (RefinedBench* bench : {&with, &without}) focus_on(bench->refined, kTop);
  with.dynamics.contacts().follow(with.state);
  for (RefinedBench* bench : {&with, &without}) bench->settle();
  REQUIRE(with.dynamics.contacts().tangents(with.state).size() > 100);
  const Vector y = with.random(with.refined.masses().size(), 5);
  Matrix k_with, d_with, k_without, d_without;
  with.refined.multiply(y, k_with, d_with);
  without.refined.multiply(y, k_without, d_without);
  const Vector moved = moved_by(with.refined, y);
  Vector k = Vector::Zero(moved.size()), d = k, f = k;
  for (const Contacts::Block& contact : with.dynamics.contacts().tangents(with.state)) {
    const std::uint32_t node = contact.nodes.front().first;
    at_node(k, node) += contact.stiffness * at_node(moved, node);
    at_node(d, node) += contact.damping * at_node(moved, node);
  }
  with.dynamics.contacts().add_forces(with.state, f);
  CHECK((k_with - k_without - gathered(with.refined, k)).norm() < 1e-9 * k_with.norm());
  CHECK((d_with - d_without - gathered(with.refined, d)).norm() < 1e-9 * d_with.norm());
  CHECK((with.refined.forces() - without.refined.forces() - gathered(with.refined, f)).norm() <
        1e-6 * gathered(with.refined, f).norm());
}
