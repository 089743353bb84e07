// Error against run time: selection of the front, and the pushed cube that provides some of the points.
#include "bench/measure/pareto.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "bench/measure/pushed_cube.hpp"
#include "server/body/dynamics.hpp"

using namespace palpate;

namespace {

std::int64_t no_clock() { return 0; }

std::vector<Vec3> force(IntegratorKind integrator, double step_s) {
  return push_cube({6, 0.004, integrator, step_s}, no_clock).force;
}

}  // namespace

TEST_CASE("The front has the points that none beats in both, by their cost") {
  const std::vector<CostAndError> points{{3, 1}, {1, 4}, {2, 2}, {2, 3}, {4, 1}, {5, 0.5}, {1, 4}, {6, 2}};
  CHECK(pareto_front(points) == std::vector<std::size_t>{1, 2, 0, 5});
  CHECK(pareto_front({}).empty());
}

TEST_CASE("The force of a pushed cube converges with the square of the step, to that of the explicit integrators") {
  const std::vector<Vec3> reference = force(IntegratorKind::tr_bdf2, 0.001);
  const double coarse = relative_rms(force(IntegratorKind::tr_bdf2, 0.05), reference);
  const double fine = relative_rms(force(IntegratorKind::tr_bdf2, 0.025), reference);
  CHECK(coarse / fine == Approx(4).epsilon(0.15));
  CHECK(relative_rms(force(IntegratorKind::leapfrog, 0.01), reference) < 1e-3);
  CHECK(relative_rms(force(IntegratorKind::stabilised, 0.01), reference) < 1e-3);
}

TEST_CASE("The force of a pushed cube of tetrahedra converges with the square of the step") {
  const auto force_at = [](double step_s) {
    return push_cube({.n = 5, .damping_s = 0.008, .step_s = step_s, .solid = true}, no_clock).force;
  };
  const std::vector<Vec3> reference = force_at(0.001);
  const double coarse = relative_rms(force_at(0.05), reference), fine = relative_rms(force_at(0.025), reference);
  CHECK(coarse / fine == Approx(4).epsilon(0.25));
  CHECK(fine < 0.01);
}

TEST_CASE(
    "Any body can be pushed by its highest node: a cube of tetrahedra that is touched otherwise gives the force of one held") {
  const PushedCube cube{.n = 5, .damping_s = 0.008, .step_s = 0.025, .solid = true};
  Scene scene = pushed_cube_scene(cube);
  const std::uint32_t middle = scene.tool.node;
  scene.tool.contact = ContactKind::touch;
  scene.tool.node = 0;
  scene.body.nodes[middle].z() += 1e-12;
  const Scene gripped = gripped_at_top(scene, IntegratorKind::tr_bdf2, cube.step_s);
  CHECK(gripped.tool.node == middle);
  CHECK(gripped.tool.contact == ContactKind::attach);
  CHECK(relative_rms(push_body(gripped, no_clock).force, push_cube(cube, no_clock).force) < 1e-6);
}

TEST_CASE(
    "A cube of finer springs is the same material: its energy in a strain differs by a share that shrinks with the spacing") {
  const auto energy_j = [](int n) {
    const Scene scene = pushed_cube_scene({n, 0.004, IntegratorKind::tr_bdf2, 0.01});
    const Dynamics dynamics(scene.body);
    BodyState state = dynamics.rest_state();
    for (Eigen::Index i = 2; i < state.x.size(); i += 3) state.x[i] *= 1.01;
    return dynamics.energy(state);
  };
  const double surface_j = (energy_j(6) - energy_j(11)) / (1.0 / 5 - 1.0 / 10);
  CHECK(surface_j > 0);
  CHECK(energy_j(16) == Approx(energy_j(11) - surface_j * (1.0 / 10 - 1.0 / 15)).epsilon(0.002));
}
