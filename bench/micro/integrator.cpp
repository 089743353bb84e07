// Gain from a finer server step: error of the felt force against the server's run time.
//
// cube6 under base-excursion, scheme port at 20 Hz over a link of RTT 0, 50 and 150 ms, real cores in virtual time (replay.hpp),
// with steps of the server's integrator from 50 ms (one per frame) down to 1 ms. dB is the signal-to-noise ratio of metrics.hpp
// against the converged full model. server_ms_per_s: simulation (without patch building) per second of body time, for the run
// with RTT 0.
#include <benchmark/benchmark.h>

#include "bench/fidelity/replay.hpp"
#include "bench/micro/benchmarks.hpp"
#include "bench/micro/fixtures.hpp"
#include "bench/micro/timer.hpp"

namespace palpate {
namespace {

constexpr int kStepsMs[] = {50, 25, 10, 5, 2, 1};
constexpr int kRttsMs[] = {0, 50, 150};
constexpr double kDurationS = 2.5;

Motion beginning_of(const Motion& motion, double duration_s) {
  std::vector<MotionPoint> points;
  for (const MotionPoint& p : motion.points())
    if (p.t_s <= duration_s) points.push_back(p);
  return Motion(std::move(points));
}

void integrator_step(benchmark::State& state, int step_ms) {
  Scene scene = scene_of("cube6");
  scene.solver.integrator = IntegratorKind::tr_bdf2;
  scene.solver.step_s = step_ms * 1e-3;
  const Motion motion = beginning_of(motion_of("base-excursion"), kDurationS);
  for (auto _ : state) {
    double server_s = 0;
    for (const int rtt_ms : kRttsMs) {
      ReplayOptions options;
      options.link.latency = Micros{500 * rtt_ms};
      const ReplayResult result = replay(scene, motion, options, steady_ns);
      state.counters["db_rtt" + std::to_string(rtt_ms)] = result.fidelity.snr_db;
      if (rtt_ms == 0) server_s = (result.frame_ms_mean - result.patch_build_ms_mean) * 1e-3 * options.rate_hz;
    }
    state.counters["server_ms_per_s"] = server_s * 1e3;
    state.SetIterationTime(server_s);
  }
}

}  // namespace

void add_integrator_benchmarks() {
  for (const int step_ms : kStepsMs)
    benchmark::RegisterBenchmark(("integrator/cube6/step_ms:" + std::to_string(step_ms)).c_str(), integrator_step, step_ms)
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
}

}  // namespace palpate
