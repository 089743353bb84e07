// Common behaviour of explicit integrators: the fallback for a body that becomes too stiff, and work shared by threads.

#include <catch2/catch.hpp>

#include "common/io/spinning_thread_pool.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/explicit_steppers.hpp"

using namespace palpate;
using namespace palpate::test;

TEMPLATE_TEST_CASE("Where stiffened springs would ask for too short steps, a frame is left to the implicit integrator and told",
                   "", Leapfrog, Stabilised) {
  LumpedBody body = box_body(4, 4, 4);
  body.law = SpringLaw::stiffening;
  body.stiffening = 4000;
  const Dynamics dynamics(body);
  TestType stepper(dynamics, Skin());
  BodyState state = dynamics.rest_state();
  state.x *= 1.2;  // strains of 20 %: springs 480 times stiffer
  std::vector<ToolPort> ports;
  const AdvanceReport report = stepper.advance(state, ports, 0.020, 0.010, {});
  CHECK(report.cut_steps > 0);
  CHECK(report.newton_iterations > 0);
  CHECK(state.x.allFinite());
}

TEMPLATE_TEST_CASE("A body that threads share moves to the same bits as one that one thread moves", "", Leapfrog, Stabilised) {
  const LumpedBody body = box_body(24, 22, 22);
  const Dynamics dynamics(body);
  const Skin skin(body);
  const auto moved_by = [&](std::size_t threads) {
    SpinningThreadPool pool(threads);
    TestType stepper(dynamics, skin);
    REQUIRE(stepper.springs() >= ExplicitBody::kWorthSharing);
    stepper.use_threads(pool);
    BodyState state = random_state(dynamics, 3, 0.001, 0.1);
    std::vector<ToolPort> ports(1);
    ports[0].parameters = {800, 0.3};
    const auto tool = [](std::size_t, double t) { return ToolAt{Vec3(0.1, 0.1, 21 * kSpacingM - 0.2 * t), Vec3(0, 0, -0.2)}; };
    REQUIRE(stepper.advance(state, ports, 0.010, 0.010, tool).cut_steps == 0);
    REQUIRE(ports[0].touching);
    return state;
  };
  const BodyState one = moved_by(1);
  for (const std::size_t threads : {2, 3, 4}) {
    const BodyState shared = moved_by(threads);
    CHECK(shared.x == one.x);
    CHECK(shared.v == one.v);
  }
}
