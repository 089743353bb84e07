// What a second of a body costs, and how wrong the force is for it: a cube whose top is pushed.
//
// A cube of 0.1 m with n x n x n nodes, bottom fixed: either springs that give it the moduli of scenes/cube6.json at any n, with
// dampers b = damping_s * k, or tetrahedra of a stable neo-Hookean solid of 10 kPa with stiffness-proportional damping of
// damping_s, six in each cell. The node in the middle of its top is taken 10 mm down along a minimum-jerk path in 0.5 s and held
// for as long again. The integrator is asked for a frame of 50 ms after the other, as a room asks for it; the force is that on
// the node at the frames' ends.
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
  double step_s = 0.010;  ///< at most; an explicit one takes shorter ones where those are stable
  bool solid = false;
};

struct PushedRun {
  std::vector<Vec3> force;  ///< on the body, a frame [N]
  double cost_s = 0;        ///< of the second, by the stopwatch
  int steps = 0, cut_steps = 0;
};

Scene pushed_cube_scene(const PushedCube& cube);
/// Any other body, to be pushed in the same way by its highest node.
Scene gripped_at_top(Scene scene, IntegratorKind integrator, double step_s);
/// `stopwatch` in nanoseconds. Throws std::runtime_error where the integrator gives up.
PushedRun push_body(const Scene& scene, const std::function<std::int64_t()>& stopwatch);
PushedRun push_cube(const PushedCube& cube, const std::function<std::int64_t()>& stopwatch);
/// Root mean square of the difference over that of the reference, of the same frames.
double relative_rms(const std::vector<Vec3>& force, const std::vector<Vec3>& reference);

}  // namespace palpate
