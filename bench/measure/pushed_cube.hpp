// Cost of a second of a body, and the resulting error of the force: a cube whose top is pushed.
//
// A cube of 0.1 m with n x n x n nodes, bottom fixed: either springs that give it the moduli of scenes/cube6.json at any n, with
// dampers b = damping_s * k, or tetrahedra of a stable neo-Hookean solid of 10 kPa with stiffness-proportional damping of
// damping_s, six in each cell. The node in the middle of its top moves down by 10 mm along a minimum-jerk path in 0.5 s and stays
// there for another 0.5 s. The integrator advances in frames of 50 ms, as in a room; the force is that on the node at the frames'
// ends.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

struct PushedCube {
  int n = 6;
  double damping_s = 0.004;
  IntegratorKind integrator = IntegratorKind::tr_bdf2;
  double step_s = 0.010;  ///< upper bound; an explicit integrator uses shorter steps for stability
  bool solid = false;
};

struct PushedRun {
  std::vector<Vec3> force;  ///< on the body, one entry per frame [N]
  double cost_s = 0;        ///< cost of the second, by the stopwatch
  int steps = 0, cut_steps = 0;
};

Scene pushed_cube_scene(const PushedCube& cube);
/// Turns any other body into one that is pushed in the same way at its highest node.
Scene gripped_at_top(Scene scene, IntegratorKind integrator, double step_s);
/// `stopwatch` counts nanoseconds. Throws std::runtime_error if the integrator gives up.
PushedRun push_body(const Scene& scene, const std::function<std::int64_t()>& stopwatch);
PushedRun push_cube(const PushedCube& cube, const std::function<std::int64_t()>& stopwatch);
/// Root mean square of the difference over that of the reference, over the same frames.
double relative_rms(const std::vector<Vec3>& force, const std::vector<Vec3>& reference);

}  // namespace palpate
