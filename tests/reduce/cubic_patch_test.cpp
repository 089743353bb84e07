// A patch of scheme cubic against the body: forces far beyond the tangent, and what cannot be had.
#include "server/reduce/cubic_patch.hpp"

#include <catch2/catch.hpp>

#include "client/player/player.hpp"
#include "server/reduce/patch_builder.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr std::uint32_t kNode = 57;

struct Grasp {
  LumpedBody body = box_body(4, 4, 4);
  Dynamics dynamics;
  Skin skin{body};
  BodyState state;
  PatchBuilder builder{dynamics, skin, 0};
  std::vector<ToolPort> ports{1};
  ToolAt tool;

  explicit Grasp(double shift_m, double speed_m_s = 0, SpringLaw law = SpringLaw::linear, std::uint64_t seed = 5)
      : dynamics((body.law = law, body)) {
    state = random_state(dynamics, seed, shift_m, speed_m_s);
    ports[0].kind = ContactKind::attach;
    ports[0].node = kNode;
    ports[0].lambda = -dynamics.element_force(state, kNode);
    tool = {node_of(state.x, kNode), node_of(state.v, kNode)};
  }
  Patch build() {
    PatchRequest request;
    request.scheme = Scheme::cubic;
    request.bridge = Micros{100'000};
    FrameModel frame(dynamics, skin);
    frame.begin(state, ports, std::span(&tool, 1), request.bridge);
    auto patch = builder.build(frame, 0, request);
    REQUIRE(patch);
    REQUIRE(check(*patch) == PatchFault::none);
    return *patch;
  }
};

}  // namespace

TEST_CASE("With the modes still, the force of a displaced tool is the body's to fourth order") {
  Grasp grasp(0.002);
  const Patch patch = grasp.build();
  const CubicTerms& terms = grasp.builder.terms();
  REQUIRE(terms.variables == patch.modes() + 3);
  const CubicForce bend(terms);
  for (const Vec3& d : {Vec3(0.0005, 0, 0), Vec3(0.0003, -0.0003, 0.0004), Vec3(0, 0.0001, -0.0005)}) {
    CubicForce::Variables u = CubicForce::Variables::Zero(patch.modes() + 3), rate = u, force;
    u.head<3>() = d;
    BodyState moved = grasp.state;
    moved.x.segment<3>(3 * kNode) += d;
    const Vec3 exact = grasp.dynamics.element_force(moved, kNode), linear = patch.force - patch.k_port * d;
    bend.evaluate(u, rate, force);
    INFO("exact " << (exact - patch.force).transpose() << ", linear " << (linear - patch.force).transpose());
    const double least = (exact - linear).norm();
    CHECK((exact - linear - Vec3(force.head<3>())).norm() < 0.02 * least);
    CHECK(least > 1e-3 * (exact - patch.force).norm());
  }
}

TEST_CASE("Terms give back the stiffness that was lifted to make the linear patch passive") {
  int lifted = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Grasp grasp(0.016, 0, SpringLaw::linear, seed);
    const Patch patch = grasp.build();
    const CubicTerms& terms = grasp.builder.terms();
    if (terms.variables == 0 || grasp.builder.report().lifted_1_s2 == 0) continue;
    ++lifted;
    const CubicForce bend(terms);
    for (int axis = 0; axis < 3; ++axis) {
      Vector k, d, e = Vector::Unit(grasp.state.x.size(), 3 * kNode + axis);
      grasp.dynamics.multiply_tangents(grasp.state, e, k, d);
      CubicForce::Variables u = CubicForce::Variables::Zero(patch.modes() + 3), rate = u, force;
      constexpr double kSmallM = 1e-7;
      u[axis] = kSmallM;
      bend.evaluate(u, rate, force);
      const Vec3 stiffness = patch.k_port.col(axis) - Vec3(force.head<3>()) / kSmallM;
      CHECK((stiffness - k.segment<3>(3 * kNode)).norm() < 1e-3 * k.segment<3>(3 * kNode).norm());
    }
  }
  CHECK(lifted > 0);
}

TEST_CASE("A body whose law has no series is served the port patch, and the builder says so") {
  Grasp grasp(0.002, 0.1, SpringLaw::thigh_skin);
  CHECK(grasp.build().scheme == Scheme::port);
  CHECK(grasp.builder.report().fell_back);
  CHECK(grasp.builder.terms().variables == 0);
  Grasp other(0.002, 0.1);
  CHECK(other.build().scheme == Scheme::cubic);
  CHECK_FALSE(other.builder.report().fell_back);
}

TEST_CASE("Trust ends where the last term is as large as the linear force") {
  Grasp grasp(0.002);
  const Patch patch = grasp.build();
  const CubicTerms& terms = grasp.builder.terms();
  CHECK(terms.radius == 1);
  for (int axis = 0; axis < 3; ++axis) {
    const double linear = patch.k_port(axis, axis) / (terms.scale(axis, axis) * terms.scale(axis, axis));
    CHECK(4 * std::abs(static_cast<double>(terms.e4[quadruple_at(axis, axis, axis, axis)])) == Approx(linear).epsilon(1e-3));
  }
}
