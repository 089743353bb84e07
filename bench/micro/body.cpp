// Parts of a server's step over body size: cubes of n^3 nodes and the organ, of springs and of tetrahedra, deformed a little so
// that no term is zero.
//
// Per spring: forces 40 operations (including a square root and a division), and 32 bytes of element in addition to the nodes'
// numbers, which stay in the second-level cache; assemble 70 operations and four 3x3 blocks read and written (576 bytes).
// Per tetrahedron (neo-Hookean, viscous; element_loops.cpp): forces 445 operations, assemble 1780 and sixteen 3x3 blocks.
// step: the integrator's matrix at 10 ms steps, A = M + a D + a^2 K, a = 2.93 ms, to 1e-2; shift: the reduction's, P = s^2 M + s
// D + K, s = 13 / s, to 1e-3. CG starts from zero; factorise is Eigen's sparse L D L^T.
#include <cmath>
#include <memory>

#include "bench/micro/benchmarks.hpp"
#include "bench/micro/fixtures.hpp"
#include "bench/micro/machine.hpp"
#include "bench/micro/timer.hpp"
#include "common/io/spinning_thread_pool.hpp"
#include "server/body/dynamics.hpp"
#include "server/dynamics/explicit_integrator.hpp"
#include "server/elements/spring_blocks.hpp"
#include "server/reduction/frame_model.hpp"
#include "server/reduction/static_indentation.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {
namespace {

/// Returns a scene of the repository (with "-corotational" its solids have the other law), "cube<n>", or "hexahedra<n>", which is
/// undamped, or with "-damped" damped by 10 ms.
Scene body_of(const std::string& name) {
  const std::string solid = "hexahedra";
  if (name.starts_with(solid))
    return solid_cube_of(std::stoi(name.substr(solid.size())), name.ends_with("-damped") ? 0.010 : 0.0);
  const std::string suffix = "-corotational";
  if (!name.ends_with(suffix)) return name.starts_with("organ") ? scene_of(name) : cube_of(std::stoi(name.substr(4)));
  Scene scene = scene_of(name.substr(0, name.size() - suffix.size()));
  for (SolidMaterial& material : scene.body.materials) material.law = SolidLaw::corotational;
  return scene;
}

struct BodyCase {
  explicit BodyCase(const std::string& name)
      : scene(body_of(name)), dynamics(scene.body), state(dynamics.rest_state()), y(state.x.size()) {
    constexpr double kDeformation = 2e-4;
    for (Eigen::Index i = 0; i < state.x.size(); ++i) {
      y[i] = std::sin(12.9898 * static_cast<double>(i));
      state.x[i] += kDeformation * y[i];
      state.v[i] = 0.01 * std::cos(78.233 * static_cast<double>(i));
    }
    for (std::size_t i = 0; i < scene.body.fixed.size(); ++i)
      if (scene.body.fixed[i]) y.segment<3>(3 * static_cast<Eigen::Index>(i)).setZero();
  }
  BlockMatrix matrix(bool step) const {
    constexpr double kA = 0.5 * (2 - M_SQRT2) * 0.010, kShift = 2.0 / 0.150;
    BlockMatrix m = dynamics.make_matrix();
    const double c_m = step ? 1 : kShift * kShift, c_d = step ? kA : kShift, c_k = step ? kA * kA : 1;
    dynamics.assemble(state, c_m, c_d, c_k, scene.body.fixed, true, m);
    return m;
  }
  bool solid() const { return scene.body.elements.empty(); }
  bool corotational() const { return solid() && scene.body.materials.front().law == SolidLaw::corotational; }
  std::size_t elements() const {
    return solid() ? scene.body.tetrahedra.size() + scene.body.hexahedra.size() : scene.body.elements.size();
  }

  Scene scene;
  Dynamics dynamics;
  BodyState state;
  Vector y;
};

/// Operations per spring and per tetrahedron, 0 if not counted: `of_peak` is the achieved share of the peak multiply-add rate.
/// Those of corotational tetrahedra depend on the deformation.
struct Operations {
  double spring = 0, tetrahedron = 0;
};
void report(benchmark::State& state, const BodyCase& body, const ProcessorTimer& timer, const Operations& operations = {}) {
  const double flops = body.corotational() || !body.scene.body.hexahedra.empty() ? 0
                       : body.solid()                                            ? operations.tetrahedron
                                                                                 : operations.spring;
  const double elements = static_cast<double>(state.iterations()) * static_cast<double>(body.elements());
  const double ns = timer.seconds() * 1e9 / elements;
  state.counters["nodes"] = static_cast<double>(body.scene.body.nodes.size());
  state.counters["ns_per_element"] = ns;
  if (flops > 0) state.counters["of_peak"] = flops / ns / machine().peak_gflops;
}

void body_forces(benchmark::State& state, const std::string& name) {
  const BodyCase body(name);
  Vector f;
  const ProcessorTimer timer;
  for (auto _ : state) {
    body.dynamics.forces(body.state.x, body.state.v, f);
    benchmark::DoNotOptimize(f.data());
  }
  report(state, body, timer, {40, 445});
}

struct BodyArrays {
  NodeArrays u, v, f;
};
BodyArrays arrays_of(const BodyCase& body) {
  const std::uint32_t nodes = body.dynamics.nodes();
  BodyArrays arrays{NodeArrays(nodes), NodeArrays(nodes), NodeArrays(nodes)};
  for (std::uint32_t i = 0; i < nodes; ++i) {
    arrays.u.set(i, at_node(body.state.x, i) - body.scene.body.nodes[i]);
    arrays.v.set(i, at_node(body.state.v, i));
  }
  return arrays;
}

/// The same for an explicit step: in single precision, block by block.
void body_blocks(benchmark::State& state, const std::string& name) {
  const BodyCase body(name);
  const SpringBlocks springs(body.scene.body);
  auto [u, v, f] = arrays_of(body);
  const ProcessorTimer timer;
  for (auto _ : state) {
    for (const auto& slabs : {springs.even_slabs(), springs.odd_slabs()})
      for (const SpringBlocks::Slab& slab : slabs) springs.add_forces(slab, u, v, f);
    benchmark::DoNotOptimize(f.x.data());
  }
  report(state, body, timer, {40, 0});
}

/// The same for hexahedra.
void body_hexahedra(benchmark::State& state, const std::string& name) {
  const BodyCase body(name);
  const HexaForces hexahedra(body.dynamics);
  auto [u, v, f] = arrays_of(body);
  const ProcessorTimer timer;
  for (auto _ : state) {
    for (const bool odd : {false, true})
      for (std::size_t k = 0; k < hexahedra.slabs(odd); ++k) hexahedra.add_forces(odd, k, u, v, f);
    benchmark::DoNotOptimize(f.x.data());
  }
  report(state, body, timer);
}

/// Steps of a body shared by `threads` threads: wall clock.
template <IntegratorKind kKind>
void body_steps(benchmark::State& state, const std::string& name, std::size_t threads) {
  constexpr double kFrameS = 0.050, kStepS = 0.010;
  constexpr auto kStages = kKind == IntegratorKind::leapfrog ? ExplicitIntegrator::Stages::one : ExplicitIntegrator::Stages::more;
  BodyCase body(name);
  const Skin nothing_to_touch;
  auto stepper = [&] {
    if constexpr (kKind == IntegratorKind::tr_bdf2)
      return Integrator(body.dynamics, nothing_to_touch, {});
    else
      return ExplicitIntegrator(body.dynamics, nothing_to_touch, kStages, ExplicitLimits(body.dynamics));
  }();
  SpinningThreadPool pool(threads);
  stepper.use_threads(pool);
  std::vector<ToolPort> no_tools;
  int steps = 0;
  double moved_s = 0;
  for (auto _ : state) {
    steps += stepper.advance(body.state, no_tools, body.state.time_s + kFrameS, kStepS, {}).steps;
    moved_s += kFrameS;
  }
  state.counters["nodes"] = static_cast<double>(body.scene.body.nodes.size());
  state.counters["steps_a_second"] = benchmark::Counter(steps, benchmark::Counter::kIsRate);
  state.counters["times_real_time"] = benchmark::Counter(moved_s, benchmark::Counter::kIsRate);
}

/// Three indentations under a tool on the middle of the top.
void body_indentations(benchmark::State& state, const std::string& name) {
  BodyCase body(name);
  const Skin skin(body.scene.body);
  const SurfacePoint top = nearest_point(skin.view(), skin.place(body.state.x), home_of(body.scene)).point;
  constexpr double kShift = 2.0 / 0.150;
  IndentationRequest request{skin.weights(top), {}, {}, kShift, {}};
  for (const double deep_m : {0.001, 0.004, 0.009}) request.displacements.push_back(-deep_m * Vec3::UnitZ());
  const WholeBody whole(body.dynamics, body.state);
  const Linearisation at(whole, body.scene.body.fixed);
  ShiftedSolver solver(body.dynamics);
  solver.prepare(at, kShift, true);
  std::vector<Vector> responses(3, Vector::Zero(body.state.x.size()));
  for (int axis = 0; axis < 3; ++axis) {
    Vector load = Vector::Zero(body.state.x.size());
    scatter(request.port, Vec3::Unit(axis), load);
    mask(body.scene.body.fixed, load);
    if (!solver.solve(at, load, 1e-3, responses[static_cast<std::size_t>(axis)])) state.SkipWithError("not definite");
  }
  request.responses = responses;
  StaticIndentations indentations(body.scene.body);
  const ProcessorTimer timer;
  for (auto _ : state) benchmark::DoNotOptimize(indentations.shapes(at, request).data());
  report(state, body, timer);
}

/// Inputs of a patch: the matrix, and the body's responses under a tool on the middle of the top that moves by 5 mm, forth or
/// back, in every frame. The body is whole or locally refined (refined_body.hpp).
void port_responses(benchmark::State& state, const std::string& name, bool refined) {
  BodyCase body(name);
  const Skin skin(body.scene.body);
  FrameModel frame(body.dynamics, skin, 0);
  ToolPort port;
  port.touching = true;
  port.lambda = Vec3(0, 0, -0.1);
  const Vec3 home = home_of(body.scene), away = home + Vec3(0.005, 0, 0);
  const SurfacePoint places[] = {nearest_point(skin.view(), skin.rest(), home).point,
                                 nearest_point(skin.view(), skin.rest(), away).point};
  std::vector<ToolPort> ports{port};
  const ToolAt at{home, Vec3::Zero()};
  constexpr double kShift = 2.0 / 0.150, kTolerance = 1e-2;
  BodyFrame& model = refined ? frame.refined() : frame.whole();
  const ProcessorTimer timer;
  std::size_t frames = 0;
  for (auto _ : state) {
    ports[0].point = places[frames++ % 2];
    frame.begin(body.state, ports, std::span(&at, 1), Micros{150'000});
    SharedSystem* const p = model.system({kShift, false, model.held()}, kTolerance);
    if (!p || !model.respond(*p, 0, true)) state.SkipWithError("the matrix is not definite");
  }
  report(state, body, timer);
}

void body_assemble(benchmark::State& state, const std::string& name) {
  const BodyCase body(name);
  BlockMatrix m = body.matrix(true);
  const ProcessorTimer timer;
  for (auto _ : state) body.dynamics.assemble(body.state, 1, 0.003, 1e-5, body.scene.body.fixed, false, m);
  report(state, body, timer, {70, 1780});
}

void body_tangents(benchmark::State& state, const std::string& name) {
  const BodyCase body(name);
  Vector k, d;
  const ProcessorTimer timer;
  for (auto _ : state) {
    body.dynamics.multiply_tangents(body.state, body.y, k, d);
    benchmark::DoNotOptimize(k.data());
  }
  report(state, body, timer);
}

void body_cg(benchmark::State& state, const std::string& name, bool step) {
  const BodyCase body(name);
  const BlockMatrix a = body.matrix(step);
  LinearSolver solver(a.rows(), LinearSolver::Method::conjugate_gradients);
  Vector x;
  SolveStats stats;
  const ProcessorTimer timer;
  for (auto _ : state) {
    solver.factorise(a);
    x = Vector::Zero(body.y.size());
    stats = solver.solve(body.y, step ? 1e-2 : 1e-3, x);
  }
  report(state, body, timer);
  state.counters["iterations_cg"] = stats.iterations;
}

void body_factorise(benchmark::State& state, const std::string& name) {
  const BodyCase body(name);
  const BlockMatrix a = body.matrix(false);
  LinearSolver solver(a.rows(), LinearSolver::Method::direct);
  bool good = solver.factorise(a);  // the pattern is analysed once per body
  const ProcessorTimer timer;
  for (auto _ : state) good = solver.factorise(a);
  report(state, body, timer);
  if (!good) state.SkipWithError("the matrix is not positive definite");
}

void body_substitute(benchmark::State& state, const std::string& name) {
  const BodyCase body(name);
  const BlockMatrix a = body.matrix(false);
  LinearSolver solver(a.rows(), LinearSolver::Method::direct);
  solver.factorise(a);
  Vector x;
  const ProcessorTimer timer;
  for (auto _ : state) solver.solve(body.y, 0, x);
  report(state, body, timer);
}

}  // namespace

void add_body_benchmarks() {
  const std::string lattices[] = {"cube6", "cube10", "cube15", "cube30", "organ-buckling"};
  for (const std::string& body : lattices)
    benchmark::RegisterBenchmark(("body/forces_in_blocks/" + body).c_str(), body_blocks, body)->MinTime(0.1);
  for (const char* body : {"cube20", "cube30"})
    for (const std::size_t threads : {1, 2}) {
      const std::string which = std::string(body) + "/threads:" + std::to_string(threads);
      benchmark::RegisterBenchmark(("body/leapfrog/" + which).c_str(), body_steps<IntegratorKind::leapfrog>, body, threads)
          ->UseRealTime()
          ->MinTime(0.5);
      benchmark::RegisterBenchmark(("body/stabilised/" + which).c_str(), body_steps<IntegratorKind::stabilised>, body, threads)
          ->UseRealTime()
          ->MinTime(0.5);
    }
  for (const char* body : {"hexahedra11", "hexahedra20", "hexahedra20-damped", "hexahedra32"})
    benchmark::RegisterBenchmark((std::string("body/forces_in_blocks/") + body).c_str(), body_hexahedra, body)->MinTime(0.1);
  const auto add_steps = [](const char* what, const char* body, auto function, std::size_t threads) {
    benchmark::RegisterBenchmark((std::string("body/") + what + "/" + body + "/threads:" + std::to_string(threads)).c_str(),
                                 function, body, threads)
        ->UseRealTime()
        ->MinTime(0.5);
  };
  for (const std::size_t threads : {1, 2}) {
    for (const char* body : {"hexahedra11", "hexahedra20", "hexahedra32"})
      add_steps("leapfrog", body, body_steps<IntegratorKind::leapfrog>, threads);
    for (const char* body : {"hexahedra11-damped", "hexahedra20-damped"})
      add_steps("stabilised", body, body_steps<IntegratorKind::stabilised>, threads);
  }
  for (const char* body : {"hexahedra11", "hexahedra11-damped", "hexahedra20", "hexahedra20-damped"})
    add_steps("implicit", body, body_steps<IntegratorKind::tr_bdf2>, 1);
  for (const char* body : {"cube6", "cube15", "organ-buckling"})
    benchmark::RegisterBenchmark((std::string("body/indentations/") + body).c_str(), body_indentations, body)->MinTime(0.1);
  for (const char* body : {"cube14", "cube20", "cube30"})
    for (const bool refined : {false, true})
      benchmark::RegisterBenchmark(("body/port_responses/" + std::string(refined ? "refined/" : "whole/") + body).c_str(),
                                   port_responses, body, refined)
          ->MinTime(0.5);
  const std::string bodies[] = {"cube6", "cube10", "cube15", "organ-buckling", "organ-solid", "organ-solid-corotational"};
  const auto add = [&](const char* what, auto function, auto... arguments) {
    for (const std::string& body : bodies)
      benchmark::RegisterBenchmark((std::string("body/") + what + "/" + body).c_str(), function, body, arguments...)
          ->MinTime(0.1);
  };
  add("forces", body_forces);
  add("assemble", body_assemble);
  add("multiply_tangents", body_tangents);
  add("cg_step", body_cg, true);
  add("cg_shift", body_cg, false);
  add("factorise", body_factorise);
  add("substitute", body_substitute);
}

}  // namespace palpate
