#include "bench/measure/release.hpp"

#include <algorithm>

#include "common/base/error.hpp"

namespace palpate {
namespace {

ClosedLoopOptions loop_options(const ReleaseOptions& o) {
  constexpr double kWindows = 7;
  ClosedLoopOptions loop;
  loop.scheme = o.scheme;
  loop.order = o.order;
  loop.rate_hz = o.rate_hz;
  loop.seed = o.seed;
  loop.compute = o.compute;
  loop.passivity = o.passivity;
  const double observe_s = o.observe_s > 0 ? o.observe_s : kWindows * kWindowS + 4 * seconds(o.link.latency);
  loop.duration = from_seconds(kReleaseS + observe_s);
  return loop;
}

LoopHand hand_of(const Scene& scene, const ReleaseOptions& o) {
  LoopHand hand{plan_gesture(scene, Gesture::release, o.depth_m).intention, {}, o.link};
  hand.device.hand = o.hand;
  hand.device.hand_after_release = o.hand_after;
  hand.device.release_s = kReleaseS;
  hand.device.tremor_m = o.tremor_m;
  hand.device.seed = o.seed;
  hand.device.force_step_n = o.force_step_n;
  hand.device.device_damping_n_s_m = o.device_damping_n_s_m;
  return hand;
}

}  // namespace

ReleaseResult release(const Scene& scene, const ReleaseOptions& options) {
  if (scene.tool.contact != ContactKind::attach)
    throw InputError("scene " + scene.name, "is touched: a tool that is let go of would fly off",
                     "a scene with tool.contact \"attach\"");
  ReleaseResult result;
  const LoopHand hand = hand_of(scene, options);
  result.loop = closed_loop(scene, std::span(&hand, 1), loop_options(options)).front();
  const std::vector<LoopTick>& ticks = result.loop.ticks;
  // A tool that was lost while held is judged by its whole motion.
  constexpr auto kReleaseTick = static_cast<std::size_t>(kReleaseS * 1e3);
  const std::size_t released = kReleaseTick < ticks.size() ? kReleaseTick : 0;
  std::vector<Vec3> position;
  std::vector<double> kinetic_j;
  for (std::size_t i = released; i < ticks.size(); ++i) {
    position.push_back(ticks[i].position);
    kinetic_j.push_back(ticks[i].kinetic_j);
  }
  result.verdict = judge_motion(position, kinetic_j, result.loop.lost);
  result.depth_m = (ticks[released].position - home_of(scene)).dot(into_body(scene));
  result.released_j = ticks[released].kinetic_j + ticks[released].display_j;
  for (const LoopTick& tick : ticks) {
    result.display_min_j = std::min(result.display_min_j, tick.display_j);
    result.hand_over_step_max_n = std::max(result.hand_over_step_max_n, tick.hand_over_step_n);
  }
  return result;
}

}  // namespace palpate
