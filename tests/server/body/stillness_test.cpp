// A body may sleep only if its motion, were it stepped, would stay below the bound.
#include "server/body/stillness.hpp"

#include <catch2/catch.hpp>

#include "server/dynamics/integrator.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// One node on a spring: w^2 = k / m.
struct Pendulum {
  LumpedBody body;
  Pendulum() {
    body.nodes = {Vec3(0, 0, 0), Vec3(0.1, 0, 0)};
    body.masses_kg = {0.01, 0.01};
    body.fixed = {1, 0};
    body.elements = {{0, 1, 0.1, 40.0, 0.01}};
  }
};

double farthest(const Vector& a, const Vector& b) {
  double far = 0;
  for (Eigen::Index i = 0; i < a.size(); i += 3) far = std::max(far, (a.segment<3>(i) - b.segment<3>(i)).norm());
  return far;
}

}  // namespace

TEST_CASE("A mass on a spring is still below the amplitude that its energy gives, whether it is displaced or moves") {
  const Pendulum p;
  const Dynamics dynamics(p.body);
  const double w2 = 40.0 / 0.01;
  Stillness stillness(dynamics, w2 / Stillness::kSofter, dynamics.rest_state().x);  // a linear spring does not soften
  const double amplitude_m = 0.5 * Stillness::kMovesM;
  BodyState state = dynamics.rest_state();
  CHECK(stillness.holds(state));
  for (const double share : {0.98, 1.02}) {
    BodyState displaced = state, moving = state;
    displaced.x[3] += share * amplitude_m;
    moving.v[3] = share * amplitude_m * std::sqrt(w2);
    CHECK(stillness.holds(displaced) == (share < 1));
    CHECK(stillness.holds(moving) == (share < 1));
  }
}

TEST_CASE("A body that counts as still moves less than the bound when it is stepped on") {
  const LumpedBody body = box_body(4, 4, 4);
  const Dynamics dynamics(body);
  const Skin skin(body, 0);
  Stillness stillness(dynamics, 400, dynamics.rest_state().x);
  BodyState state = dynamics.rest_state();
  state.x[3 * 63 + 2] -= 0.01;
  Integrator integrator(dynamics, skin, {0.005});
  std::vector<ToolPort> none;
  int frames = 0;
  for (; !stillness.holds(state) && frames < 1000; ++frames) integrator.advance(state, none, state.time_s + 0.05, {});
  CHECK(frames > 3);
  REQUIRE(frames < 1000);
  const Vector at_once = state.x;
  double far = 0;
  for (int k = 0; k < 200; ++k) {
    integrator.advance(state, none, state.time_s + 0.01, {});
    far = std::max(far, farthest(state.x, at_once));
  }
  CHECK(far < Stillness::kMovesM);
}

TEST_CASE("A body that is not fixed anywhere never counts as still") {
  const LumpedBody body = box_body(3, 3, 3);
  const Dynamics dynamics(body);
  CHECK_FALSE(Stillness(dynamics, 0, dynamics.rest_state().x).holds(dynamics.rest_state()));
}
