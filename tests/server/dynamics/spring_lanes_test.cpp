// Springs in lanes against one after the other, at every width of this processor: equal to the bit.
#include "server/elements/spring_lanes.hpp"

#include <catch2/catch.hpp>

#include "server/elements/spring_kernel.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

TEST_CASE("Forces of springs side by side are those of one after the other to the bit", "[body]") {
  LumpedBody body = box_body(4, 3, 5);
  body.law = GENERATE(SpringLaw::linear, SpringLaw::stiffening);
  body.stiffening = 30;
  body.elements[3].rest_length_m *= 1.3;
  body.elements[5].stiffness_n_m *= 7;
  const Dynamics dynamics(body);
  BodyState state = random_state(dynamics, 4, 0.004, 0.5);
  const Element& flat = body.elements[20];  // now of zero length
  at_node(state.x, flat.b) = at_node(state.x, flat.a);
  const SpringKernel kernel(body.law, body.stiffening);
  Vector expected = Vector::Constant(state.x.size(), 0.125);
  for (const Element& e : body.elements) {
    const Vec3 force = SpringKernel::force_on_a(
        kernel.evaluate(e, at_node(state.x, e.b) - at_node(state.x, e.a), at_node(state.v, e.b) - at_node(state.v, e.a)));
    at_node(expected, e.a) += force;
    at_node(expected, e.b) -= force;
  }
  const std::vector<SpringGroup> groups = spring_groups(body);
  REQUIRE(body.elements.size() % SpringGroup::kSize != 0);
  for (const auto& loops : spring_loops()) {
    INFO(loops.width << " in a vector");
    Vector f = Vector::Constant(state.x.size(), 0.125);
    loops.run(groups, body.law == SpringLaw::stiffening ? body.stiffening : 0, state.x.data(), state.v.data(), f.data());
    CHECK(f == expected);
  }
}

TEST_CASE("Springs of a law that decides are not grouped", "[body]") {
  LumpedBody body = box_body(2, 2, 2);
  body.law = SpringLaw::thigh_skin;
  CHECK(spring_groups(body).empty());
}
