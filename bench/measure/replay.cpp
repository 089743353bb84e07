#include "bench/measure/replay.hpp"

#include <algorithm>
#include <stdexcept>

#include "bench/measure/reference.hpp"
#include "client/device/replay_device.hpp"
#include "client/device/sim_phantom.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr Micros kJoinWithin{10'000'000}, kClocksLock{300'000};

std::unique_ptr<MotionDevice> make_device(const Motion& motion, const ReplayOptions& options) {
  if (!options.simulated_device) return std::make_unique<ReplayDevice>(motion);
  SimPhantomOptions phantom;
  phantom.seed = options.seed;
  return std::make_unique<SimPhantom>(motion, phantom);
}

struct Times {
  double sum_ms = 0;
  std::uint64_t count = 0;
  void add(std::int64_t ns) {
    sum_ms += static_cast<double>(ns) * 1e-6;
    ++count;
  }
  double mean() const { return count > 0 ? sum_ms / static_cast<double>(count) : 0; }
};

/// The swaps of a run, with the tick of each.
struct Swap {
  std::size_t tick = 0;
  HandOver between;
};

/// For each swap the largest change from tick to tick that follows within its cross-fade, beyond the reference's own.
std::vector<HandOver> felt_steps(const std::vector<ReplayTick>& ticks, const std::vector<Swap>& swaps) {
  constexpr std::size_t kFadedWithin = 25;
  std::vector<HandOver> steps;
  for (std::size_t k = 0; k < swaps.size(); ++k) {
    std::size_t end = std::min(swaps[k].tick + kFadedWithin, ticks.size());
    if (k + 1 < swaps.size()) end = std::min(end, swaps[k + 1].tick);
    HandOver step{0, swaps[k].between.force_n};
    for (std::size_t i = std::max<std::size_t>(swaps[k].tick, 1); i < end; ++i)
      step.step_n = std::max(step.step_n,
                             (ticks[i].felt - ticks[i - 1].felt).norm() - (ticks[i].reference - ticks[i - 1].reference).norm());
    steps.push_back(step);
  }
  return steps;
}

void measure(ReplayResult& result, const ReferenceForce& reference, const std::vector<Swap>& swaps) {
  std::vector<Vec3> felt;
  std::vector<std::uint8_t> contact;
  std::vector<double> ages_us;
  for (std::size_t i = 0; i < result.ticks.size(); ++i) {
    ReplayTick& tick = result.ticks[i];
    tick.reference = reference.force[i];
    tick.true_contact = reference.contact[i] != 0;
    felt.push_back(tick.felt);
    contact.push_back(tick.contact);
    if (tick.patch_age >= Micros{}) ages_us.push_back(static_cast<double>(tick.patch_age.count()));
  }
  result.fidelity = compare(felt, reference.force, kSkipTicks);
  result.onset = onset_errors(contact, reference.contact);
  std::vector<HandOver> between;
  for (const Swap& swap : swaps) between.push_back(swap.between);
  result.hand_over = hand_over_steps(between);
  result.felt_step = hand_over_steps(felt_steps(result.ticks, swaps));
  result.age_p95 = from_seconds(1e-6 * percentile(std::move(ages_us), 0.95));
}

}  // namespace

ReferenceForce reference_of(const Scene& scene, const Motion& motion) {
  std::vector<Vec3> positions;
  for (Micros t{}; t <= motion.duration(); t += kTick) positions.push_back(motion.position(t));
  return reference_force(scene, positions);
}

ReplayResult replay(const Scene& scene, const Motion& motion, const ReplayOptions& options, const Stopwatch& stopwatch) {
  ReplayResult result;
  World world(scene, {options.rate_hz, options.compute, options.seed});
  ClientOptions client;
  client.hello.station = "replay";
  client.hello.scheme = options.scheme;
  client.hello.order = static_cast<std::uint16_t>(options.order);
  client.guard.passivity = options.passivity;
  auto device = make_device(motion, options);
  if (options.simulated_device) {
    client.guard.force_max_n = device->caps().force_max_n;
    client.guard.slew_max_n_s = device->caps().slew_max_n_s;
  }
  device->wait_for_start();
  WorldStation& station = world.add_station(client, std::move(device), options.link);

  Times build, frame;
  world.run_frame = [&](Room& room, const FrameJob& job) {
    const auto t0 = stopwatch();
    FrameResult r = room.simulate(job);
    const auto t1 = stopwatch();
    room.build_patches(job, r);
    const auto t2 = stopwatch();
    frame.add(t2 - t0);
    if (!r.stations.empty() && r.stations[0].patch) build.add(t2 - t1);
    return r;
  };
  std::vector<double> tick_ns;
  station.run_tick = [&](HapticTick& haptic, const ToolSample& sample) {
    const auto t0 = stopwatch();
    const TickOutput out = haptic.tick(sample);
    tick_ns.push_back(static_cast<double>(stopwatch() - t0));
    return out;
  };

  // Join and, for a grasp, wait for the first patch; then let what the grasp disturbed die out.
  bool has_patch = false;
  station.on_tick = [&](Micros, const Vec3&, const TickOutput& out) { has_patch = out.has_patch; };
  const bool wants_patch = scene.tool.contact == ContactKind::attach;
  while (station.core().link() != LinkState::joined || (wants_patch && !has_patch)) {
    if (station.core().link() == LinkState::refused)
      throw InputError("--scheme " + std::string(name_of(options.scheme)), "refused by the server: " + station.core().refusal(),
                       "a scheme and order that it takes");
    if (world.now() > kJoinWithin) throw std::runtime_error("no answer over this link within 10 s of virtual time");
    world.run_until(world.now() + Micros{1000});
  }
  // A tool that only may touch gets its first patch, if it is in reach, when the clocks have locked.
  if (!wants_patch) world.run_until(world.now() + kClocksLock + 4 * options.link.latency);
  const Vec3 start = motion.position(0.0);
  if (needs_settling(scene, start)) world.run_until(world.now() + kSettle);

  // Time 0 of the motion lies on a frame, so that equal runs at other rates and delays compare the same phases.
  const Micros frame_length = from_seconds(1 / options.rate_hz);
  const Micros begin = (world.now() / frame_length + 1) * frame_length;
  station.device().start(station.clock(begin));
  const auto ticks = static_cast<std::size_t>(motion.duration() / kTick) + 1;
  std::vector<Vec3> positions;
  std::vector<Swap> swaps;
  station.on_tick = [&](Micros t, const Vec3& position, const TickOutput& out) {
    if (t < begin || result.ticks.size() >= ticks) return;
    if (out.swapped) swaps.push_back({result.ticks.size(), {out.hand_over_step_n, out.force.norm()}});
    result.ticks.push_back({position, out.force, Vec3::Zero(), out.has_patch ? out.patch_age : Micros{-1}, out.contact, false});
    positions.push_back(position);
  };
  tick_ns.clear();
  const std::uint64_t used_before = station.core().haptic().counts().patches_used;
  const std::uint64_t sent_before = station.core().counts().bytes_sent;
  world.run_until(begin + motion.duration());

  const bool known = options.reference && !options.simulated_device && options.reference->force.size() == positions.size();
  measure(result, known ? *options.reference : reference_force(scene, positions), swaps);
  const ClientCounts& counts = station.core().counts();
  result.patches_used = station.core().haptic().counts().patches_used - used_before;
  result.patch_bytes_mean =
      counts.patches > 0 ? static_cast<double>(counts.patch_bytes) / static_cast<double>(counts.patches) : 0;
  result.patch_states = station.core().last_patch().states();
  result.guard = station.core().haptic().guard_counts();
  result.uplink_bytes_s = static_cast<double>(counts.bytes_sent - sent_before) / seconds(motion.duration());
  result.tick_ns_p50 = percentile(tick_ns, 0.5);
  result.tick_ns_p99 = percentile(std::move(tick_ns), 0.99);
  result.patch_build_ms_mean = build.mean();
  result.frame_ms_mean = frame.mean();
  return result;
}

}  // namespace palpate
