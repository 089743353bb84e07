#include "bench/measure/pushed_cube.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bench/measure/gestures.hpp"
#include "server/body/settle.hpp"
#include "server/dynamics/integrator_selection.hpp"
#include "server/scene/settings.hpp"

namespace palpate {
namespace {

constexpr double kSideM = 0.1, kPushM = 0.010, kPushS = 0.5, kFrameS = 0.05;
constexpr int kFrames = 20;

}  // namespace

Scene pushed_cube_scene(const PushedCube& cube) {
  // A spring between planes of nodes represents a share of the cross-section that shrinks with the square of their distance, over
  // a length that shrinks with it: so k is proportional to the distance.
  constexpr double kCube6 = 60, kCube6Edges = 5;
  const double k = kCube6 * kCube6Edges / (cube.n - 1);
  const std::string material =
      cube.solid
          ? fmt::format(R"("solid": {{ "element": "tetrahedron", "law": "neo-hookean", "young_pa": 10000, "damping_s": {} }})",
                        cube.damping_s)
          : fmt::format(R"("stiffness_n_m": {}, "damping_n_s_m": {})", k, k * cube.damping_s);
  return read_scene(fmt::format(R"({{
    "name": "cube{0}",
    "body": {{ "lattice": {{ "nodes": [{0}, {0}, {0}], "size_m": [{1}, {1}, {1}], "density_kg_m3": 1000,
      {2}, "fixed_faces": ["z-"] }} }},
    "tool": {{ "contact": "attach", "node": [{3}, {3}, {4}] }},
    "solver": {{ "integrator": "{5}", "step_ms": {6} }} }})",
                                cube.n, kSideM, material, (cube.n - 1) / 2, cube.n - 1,
                                kIntegratorNames[static_cast<std::size_t>(cube.integrator)], 1e3 * cube.step_s),
                    fmt::format("cube of {} nodes an edge", cube.n));
}

Scene gripped_at_top(Scene scene, IntegratorKind integrator, double step_s) {
  const std::vector<Vec3>& nodes = scene.body.nodes;
  const auto top = std::max_element(nodes.begin(), nodes.end(), [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
  scene.tool.contact = ContactKind::attach;
  scene.tool.node = static_cast<std::uint32_t>(top - nodes.begin());
  scene.solver.integrator = integrator;
  scene.solver.step_s = step_s;
  return scene;
}

PushedRun push_cube(const PushedCube& cube, const std::function<std::int64_t()>& stopwatch) {
  return push_body(pushed_cube_scene(cube), stopwatch);
}

PushedRun push_body(const Scene& scene, const std::function<std::int64_t()>& stopwatch) {
  const Dynamics dynamics(scene.body);
  const Skin skin(scene.body, scene.tool.radius_m);
  const ChosenStepper chosen = choose_stepper(scene, dynamics, skin);
  BodyState state = settled_state(dynamics, scene.name);
  const Vec3 home = scene.body.nodes[scene.tool.node];
  ToolPort port;
  port.kind = ContactKind::attach;
  port.node = scene.tool.node;
  std::vector<ToolPort> ports{port};
  const ToolMotion tool = [&](std::size_t, double t) {
    return ToolAt{home - Vec3(0, 0, kPushM * minimum_jerk(std::clamp(t / kPushS, 0.0, 1.0))), Vec3::Zero()};
  };
  PushedRun run;
  const std::int64_t begin = stopwatch();
  for (int frame = 1; frame <= kFrames; ++frame) {
    const AdvanceReport report = chosen.stepper->advance(state, ports, kFrameS * frame, scene.solver.step_s, tool);
    if (!report.converged) throw std::runtime_error(fmt::format("the integrator gave up in frame {}", frame));
    run.steps += report.steps;
    run.cut_steps += report.cut_steps;
    run.force.push_back(ports[0].lambda);
  }
  run.cost_s = 1e-9 * static_cast<double>(stopwatch() - begin);
  return run;
}

double relative_rms(const std::vector<Vec3>& force, const std::vector<Vec3>& reference) {
  double apart = 0, whole = 0;
  for (std::size_t i = 0; i < std::min(force.size(), reference.size()); ++i) {
    apart += (force[i] - reference[i]).squaredNorm();
    whole += reference[i].squaredNorm();
  }
  return std::sqrt(apart / whole);
}

}  // namespace palpate
