// The nonlinear part of a large body, and the patches of scheme `hyper` made from it, against the whole body.
#include "server/operators/nonlinear_subdomain.hpp"

#include <catch2/catch.hpp>

#include "server/reduction/patch_build.hpp"
#include "tests/support/large_body.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// A block with a held node on its top, and everything around it indented.
struct Large {
  LumpedBody body = large_body();
  Dynamics dynamics{body};
  RefinedBody refined{dynamics};
  BodyState state = dynamics.rest_state();

  Large() { indent(0.3); }
  void indent(double spacings) {
    const double reach = 2.5 * refined.spacing_m();
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
      const Vec3 away = body.nodes[i] - body.nodes[kTop];
      if (!body.fixed[i])
        at_node(state.x, i) +=
            spacings * refined.spacing_m() * std::exp(-away.squaredNorm() / (reach * reach)) * Vec3(0.5, 0.2, -1);
    }
  }
  void focus(std::uint32_t node) {
    focus_on(refined, node);
    refined.take(state);
  }
  Vector random(std::uint64_t seed, double size) const {
    Random random(seed);
    Vector y(refined.masses().size());
    for (double& value : y) value = random.uniform(-size, size);
    return y;
  }
};

}  // namespace

TEST_CASE(
    "The nonlinear subdomain of a large body moves with it, and what acts on it acts on the coordinates: no work is made or "
    "lost") {
  Large large;
  large.focus(kTop);
  NonlinearSubdomain part(large.refined);
  part.take(large.body.nodes[kTop], large.state);
  CHECK(part.body().dynamics().nodes() < large.dynamics.nodes() / 3);
  const Vector y = large.random(1, 1e-3), whole = moved_by(large.refined, y), moved = part.moved(y);
  int far = 0;  // nodes interpolated from corners
  for (std::uint32_t i = 0; i < part.body().dynamics().nodes(); ++i) {
    const Vec3 rest = part.body().dynamics().body().nodes[i];
    for (std::uint32_t node = 0; node < large.dynamics.nodes(); ++node)
      if (large.body.nodes[node] == rest) {
        CHECK((at_node(moved, i) - at_node(whole, node)).norm() <= 1e-15);
        CHECK(at_node(part.body().state().x, i) == at_node(large.state.x, node));
        far += large.refined.coordinate(node) == RefinedBody::kNone;
      }
  }
  CHECK(far > 0);
  Vector f = Vector::LinSpaced(moved.size(), -1, 2);
  CHECK(part.gathered(f).dot(y) == Approx(f.dot(moved)).epsilon(1e-12));
}

TEST_CASE("Forces on the tool's node, however far it goes, are those of the whole body") {
  Large large;
  large.focus(kTop);
  NonlinearSubdomain part(large.refined);
  part.take(large.body.nodes[kTop], large.state);
  const Vector y = large.random(2, 0.3 * large.refined.spacing_m());
  Vector here, there, near_here, near_there;
  const Vector still = Vector::Zero(large.state.x.size()), near_still = Vector::Zero(part.body().state().x.size());
  large.dynamics.forces(large.state.x, still, here);
  large.dynamics.forces(large.state.x + moved_by(large.refined, y), still, there);
  part.body().dynamics().forces(part.body().state().x, near_still, near_here);
  part.body().dynamics().forces(part.body().state().x + part.moved(y), near_still, near_there);
  const Vec3 exact = at_node(there, kTop) - at_node(here, kTop);
  const Vector got = part.gathered(near_there - near_here);
  CHECK((at_node(got, large.refined.coordinate(kTop)) - exact).norm() < 1e-10 * exact.norm());
}

TEST_CASE("A nonlinear subdomain goes with the tool, and with the coordinates when these change under it") {
  Large large;
  const Vec3 start = large.body.nodes[kTop];
  large.focus(kTop);
  NonlinearSubdomain part(large.refined);
  part.take(start, large.state);
  const std::uint32_t nodes = part.body().dynamics().nodes();
  const Dynamics* kept = &part.body().dynamics();
  part.take(start + Vec3(0.5 * large.refined.spacing_m(), 0, 0), large.state);
  CHECK(&part.body().dynamics() == kept);
  const std::uint64_t before = large.refined.generation();
  const std::uint32_t corner = kLargeEdge * kLargeEdge * (kLargeEdge - 1);
  large.focus(corner);
  REQUIRE(large.refined.generation() != before);
  part.take(large.body.nodes[corner], large.state);
  CHECK(part.body().dynamics().nodes() < nodes);  // a quarter of its size in the middle
  const Vector y = large.random(3, 1e-3);
  CHECK(part.gathered(Vector::Ones(part.moved(y).size())).dot(y) == Approx(part.moved(y).sum()).epsilon(1e-12));
}

TEST_CASE("Where a large body was in the last frames is kept in the coordinates it has now, its momentum with it") {
  Large large;
  const Skin skin;
  FrameModel frame(large.dynamics, skin, 0);
  const std::vector<ToolPort> ports = grasped_top();
  const ToolAt tool;
  std::vector<Vector> shapes;
  for (int k = 0; k < 4; ++k) {
    if (k > 0) large.indent(0.1);
    large.state.time_s = 0.05 * k;
    frame.begin(large.state, ports, std::span(&tool, 1), Micros{50'000});
    shapes.push_back(large.state.x);
    const SnapshotSet& snapshots = frame.refined().snapshots();
    const Matrix states = snapshots.weighted();
    const auto history = snapshots.of(SnapshotKind::history), rest = snapshots.of(SnapshotKind::rest);
    REQUIRE(history.size() == static_cast<std::size_t>(k));
    REQUIRE(rest.size() == 1);
    const Linearisation at = frame.refined().linearisation();
    const Vector y = Vector::LinSpaced(at.masses().size(), -1, 1), moved = at.body->of_nodes(y);
    for (int past = 0; past < k; ++past) {
      const Vector way = large.dynamics.masses().cwiseProduct(shapes[static_cast<std::size_t>(past)] - large.state.x);
      CHECK(at.masses().cwiseProduct(states.col(history[static_cast<std::size_t>(past)])).dot(y) ==
            Approx(way.dot(moved)).epsilon(1e-9));
    }
    const Vector home = large.dynamics.masses().cwiseProduct(large.dynamics.rest_state().x - large.state.x);
    CHECK(at.masses().cwiseProduct(states.col(rest[0])).dot(y) == Approx(home.dot(moved)).epsilon(1e-9));
  }
}

TEST_CASE("A hyper-reduced patch of a large body bends as the whole body does on its modes, where the linear one does not") {
  Large large;
  const Skin skin;
  FrameModel frame(large.dynamics, skin, 0);
  std::vector<ToolPort> ports = grasped_top();
  ports[0].lambda = -large.dynamics.element_force(large.state, kTop);
  const ToolAt tool{at_node(large.state.x, kTop), Vec3::Zero()};
  PatchRequest request;
  request.scheme = Scheme::hyper;
  request.horizon = Micros{100'000};
  frame.begin(large.state, ports, std::span(&tool, 1), request.horizon);
  const auto built = build_patch(frame, 0, request);
  REQUIRE(built);
  const Patch* const patch = &built->patch;
  REQUIRE(check(*patch) == PatchFault::none);
  REQUIRE(patch->scheme == Scheme::hyper);
  const Matrix modes = built->modes.of_nodes();
  REQUIRE(modes.rows() == large.state.x.size());
  Matrix moved(modes.rows(), modes.cols() + 3);
  moved.leftCols<3>().setZero();
  moved.middleRows<3>(3 * Eigen::Index{kTop}).leftCols<3>().setIdentity();
  moved.rightCols(modes.cols()) = modes;
  const Vector still = Vector::Zero(modes.rows());
  Vector here, there;
  large.dynamics.forces(large.state.x, still, here);
  NonlinearForce bend(built->terms, *patch);
  Random random(4);
  for (int k = 0; k < 5; ++k) {
    // The tool moves a third of a spacing in any direction, and the modes follow.
    Vector u(moved.cols());
    for (Eigen::Index i = 0; i < 3; ++i) u[i] = random.uniform(-1, 1);
    u.head<3>() *= large.refined.spacing_m() / 3 / u.head<3>().norm();
    u.tail(modes.cols()) = (patch->b_k * u.head<3>()).cwiseQuotient(patch->stiffness);
    large.dynamics.forces(large.state.x + moved * u, still, there);
    Vector k_u, d_u;
    large.dynamics.multiply_tangents(large.state, moved * u, k_u, d_u);
    const Vector exact = moved.transpose() * (there - here + k_u);
    NonlinearForce::Variables force;
    bend.move_to(u);
    bend.elastic(force);
    INFO("exact " << exact.transpose() << "\n got  " << force.transpose());
    CHECK((force - exact).norm() < 0.1 * exact.norm());
  }
}
