// A body that a tool presses, and what it yields when the tool goes further.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>

#include "server/dynamics/integrator.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate::test {

/// Stiffness of the tool in its contact with the body [N/m].
struct Yield {
  double by_force = 0;     ///< change of the force over a further way
  double by_tangents = 0;  ///< of the assembled matrix, in series with the contact
  SurfacePoint point;      ///< that is pressed
};

/// Presses 4 mm deep from above at `top`, a point of the upper side, without friction, and 0.1 mm further.
inline Yield yield_of(const LumpedBody& body, const Vec3& top) {
  const Dynamics dynamics(body);
  const Skin skin(body, 0.03);
  constexpr double kContactNM = 500, kPressedM = 0.004, kFurtherM = 1e-4;
  Integrator integrator(dynamics, skin, {0.005, 1e-10});
  BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports(1);
  ports[0].parameters = {kContactNM, 0.0};
  const auto pressed = [&](double depth_m, double until_s) {
    const auto tool = [&](std::size_t, double t) { return ToolAt{top - Vec3(0, 0, std::min(depth_m, 0.1 * t - 0.005))}; };
    REQUIRE(integrator.advance(state, ports, until_s, tool).converged);
    return -ports[0].lambda.z();
  };
  const double before_n = pressed(kPressedM, 3);
  Yield yield;
  yield.point = ports[0].point;
  Vector b = Vector::Zero(state.x.size());
  scatter(skin.weights(yield.point), Vec3::UnitZ(), b);
  BlockMatrix k = dynamics.make_matrix();
  dynamics.assemble(state, 0, 0, 1, body.fixed, false, k);
  LinearSolver solver(dynamics.nodes(), LinearSolver::Method::direct);
  REQUIRE(solver.factorise(k));
  Vector u = Vector::Zero(b.size());
  solver.solve(b, 1e-12, u);
  yield.by_tangents = 1 / (gather(skin.weights(yield.point), u).z() + 1 / kContactNM);
  yield.by_force = (pressed(kPressedM + kFurtherM, 4) - before_n) / kFurtherM;
  return yield;
}

}  // namespace palpate::test
