// A server's frame at 20 Hz under a hand, with room and patch builder as in palpate-server, without the network.
//
// Time is the mean over frames; realtime = frame length / mean frame. A frame without contact in reach builds no patch: `built`
// is the share of frames with a patch, build_ms the mean over these.
#include <benchmark/benchmark.h>

#include <vector>

#include "bench/fidelity/metrics.hpp"
#include "bench/micro/benchmarks.hpp"
#include "bench/micro/fixtures.hpp"

namespace palpate {
namespace {

struct Play {
  const char *scene, *motion;
  bool above;     ///< move the motion to start just over the body's top
  double from_s;  ///< start of the measured part
  int frames;
};
constexpr Play kPlays[] = {{"cube6", "base-excursion", false, 0, 60},      {"touch-cube", "press", true, 0, 60},
                           {"touch-cube", "stroke", true, 0.5, 60},        {"organ", "organ-tour", false, 0, 60},
                           {"organ-buckling", "organ-tour", false, 0, 60}, {"organ-buckling", "organ-tour", false, 6, 40}};
constexpr Scheme kSchemes[] = {Scheme::hold, Scheme::tangent, Scheme::ring, Scheme::port};
constexpr double kStartHeightM = 0.001;

void frames(benchmark::State& state, const Play& play, Scheme scheme) {
  const Scene scene = scene_of(play.scene);
  const Motion recorded = motion_of(play.motion);
  FrameDriver driver(scene, play.above ? above(scene, recorded, kStartHeightM) : recorded, scheme);
  const double frame_s = seconds(FrameDriver::kFrame);
  for (double t = 0; t < play.from_s; t += frame_s) driver.next();
  std::vector<double> total_ms;
  double simulate_ms = 0, build_ms = 0, sum_ms = 0;
  int built = 0, failed = 0, steps = 0;
  for (auto _ : state) {
    const FrameResult result = driver.next();
    const double ms = driver.simulate_ms() + driver.build_ms();
    state.SetIterationTime(ms * 1e-3);
    total_ms.push_back(ms);
    sum_ms += ms;
    simulate_ms += driver.simulate_ms();
    steps += result.steps;
    failed += result.failed;
    if (!result.stations[0].patch) continue;
    build_ms += driver.build_ms();
    ++built;
  }
  const auto n = static_cast<double>(total_ms.size());
  state.counters["simulate_ms"] = simulate_ms / n;
  state.counters["build_ms"] = built > 0 ? build_ms / built : 0;
  state.counters["built"] = built / n;
  state.counters["p99_ms"] = percentile(total_ms, 0.99);
  state.counters["steps"] = steps / n;
  state.counters["realtime"] = frame_s * 1e3 / (sum_ms / n);
  if (failed > 0) state.SkipWithError("a frame did not converge");
}

}  // namespace

void add_frame_benchmarks() {
  for (const Play& play : kPlays)
    for (const Scheme scheme : kSchemes) {
      std::string name = std::string("frame/") + play.scene + "/" + play.motion;
      if (play.from_s > 0) name += "_from_" + std::to_string(static_cast<int>(play.from_s * 1e3)) + "ms";
      name += "/" + std::string(name_of(scheme));
      benchmark::RegisterBenchmark(name.c_str(), frames, play, scheme)
          ->Iterations(play.frames)
          ->UseManualTime()
          ->Unit(benchmark::kMillisecond);
    }
}

}  // namespace palpate
