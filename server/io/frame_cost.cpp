#include "server/io/frame_cost.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "common/io/monotonic.hpp"
#include "common/io/processor_time.hpp"
#include "common/player/player.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr Micros kLongest{400'000};
constexpr std::size_t kFramesMost = 12;
constexpr double kDeepM = 0.006, kSwingHz = 1.5, kDownS = 0.2;

std::int64_t processor_ns() { return 1000 * processor_now().count(); }

/// Height along the outward normal, in units of the depth.
double height_at(double t_s) {
  constexpr double kAbove = 0.5, kSwing = 0.3;
  const double c = std::clamp(t_s / kDownS, 0.0, 1.0);
  return kAbove - (kAbove + 1) * c * c * (3 - 2 * c) + kSwing * std::sin(2 * M_PI * kSwingHz * t_s) * c;
}

double usual_depth(const LumpedBody& body) {
  Vec3 low = body.nodes.front(), high = low;
  for (const Vec3& x : body.nodes) low = low.cwiseMin(x), high = high.cwiseMax(x);
  double depth_m = kDeepM;
  for (const double side_m : high - low)
    if (side_m > 0) depth_m = std::min(depth_m, 0.1 * side_m);
  return depth_m;
}

class Trial {
 public:
  Trial(const Scene& scene, const SurfaceStiffness& place, double rate_hz, const std::function<std::int64_t()>& stopwatch,
        double depth_m)
      : room_(scene),
        stopwatch_(stopwatch ? stopwatch : processor_ns),
        place_(place),
        depth_m_(depth_m),
        frame_(from_seconds(1 / rate_hz)) {
    room_.listen([this](BuildPhase phase) {
      const double now = now_ms();
      if (std::exchange(in_rollouts_, phase == BuildPhase::rollouts)) rollouts_ms_ += now - phase_began_ms_;
      phase_began_ms_ = now;
    });
    room_.start(job_.target);
    job_.frame = frame_;
  }

  /// Moves the hand from above into the body.
  void go_in() { room_.simulate(next(from_seconds(kDownS), Scheme::port)); }

  struct Times {
    double step_ms;
    std::optional<double> patch_ms;  ///< empty without a patch
    double rollouts_ms = 0;
  };
  /// Runs a frame; empty if the step found no solution.
  std::optional<Times> frame(Scheme scheme) {
    const FrameJob& job = next(frame_, scheme);
    const double begin = now_ms();
    FrameResult result = room_.simulate(job);
    if (result.failed) return std::nullopt;
    const double stepped = now_ms();
    rollouts_ms_ = 0;
    room_.build_patches(job, result);
    const double built = now_ms();
    const bool patch = result.stations.front().patch.has_value();
    return Times{stepped - begin, patch ? std::optional(built - stepped) : std::nullopt, rollouts_ms_};
  }

 private:
  double now_ms() const { return 1e-6 * static_cast<double>(stopwatch_()); }
  const FrameJob& next(Micros length, Scheme scheme) {
    StationJob hand;
    hand.id = 1;
    hand.scheme = scheme;
    hand.horizon = 2 * frame_;
    job_.begin = job_.target;
    job_.target += length;
    for (Micros t = job_.begin + kTick; t <= job_.target; t += kTick)
      hand.samples.push_back({t, place_.place + depth_m_ * height_at(seconds(t)) * place_.outward});
    job_.stations = {std::move(hand)};
    return job_;
  }

  Room room_;
  std::function<std::int64_t()> stopwatch_;
  SurfaceStiffness place_;
  double depth_m_;
  Micros frame_;
  FrameJob job_;
  bool in_rollouts_ = false;
  double phase_began_ms_ = 0, rollouts_ms_ = 0;
};

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

std::optional<FrameCost> frame_cost(const Scene& scene, const SurfaceStiffness& place, double rate_hz,
                                    const std::function<std::int64_t()>& stopwatch, std::optional<double> depth_m) {
  if (scene.body.nodes.size() > kTimedNodesMost) return std::nullopt;
  Trial trial(scene, place, rate_hz, stopwatch, depth_m.value_or(usual_depth(scene.body)));
  trial.go_in();
  std::vector<double> steps, port, hyper, rollouts;
  const Micros begin = monotonic_now(), used = processor_now();
  while (hyper.size() < kFramesMost && monotonic_now() - begin < kLongest)
    for (const Scheme scheme : {Scheme::port, Scheme::hyper}) {
      const auto times = trial.frame(scheme);
      if (!times) return std::nullopt;
      steps.push_back(times->step_ms);
      if (!times->patch_ms) continue;
      (scheme == Scheme::hyper ? hyper : port).push_back(*times->patch_ms);
      if (scheme == Scheme::hyper) rollouts.push_back(times->rollouts_ms);
    }
  if (hyper.empty() || port.empty()) return std::nullopt;
  constexpr double kShareLeast = 0.01;
  const double share = seconds(processor_now() - used) / seconds(std::max(monotonic_now() - begin, Micros{1}));
  return FrameCost{.step_ms = mean(steps),
                   .port_ms = mean(port),
                   .hyper_ms = mean(hyper),
                   .step_most_ms = *std::ranges::max_element(steps),
                   .rollouts_ms = mean(rollouts),
                   .core_share = std::clamp(share, kShareLeast, 1.0)};
}

}  // namespace palpate
