#include "bench/measure/replay.hpp"

#include <algorithm>

#include "bench/measure/join.hpp"
#include "bench/measure/reference.hpp"
#include "client/device/replay_device.hpp"
#include "client/device/sim_phantom.hpp"

namespace palpate {
namespace {

std::unique_ptr<MotionDevice> make_device(const Motion& motion, const ReplayOptions& options) {
  if (!options.simulated_device) return std::make_unique<ReplayDevice>(motion);
  SimPhantomOptions phantom;
  phantom.seed = options.seed;
  return std::make_unique<SimPhantom>(motion, phantom);
}

/// The k-th station of a replay: the first is what a replay alone would be.
WorldStation& add_station(World& world, const Motion& motion, const ReplayOptions& options, std::size_t k) {
  constexpr std::uint64_t kSeedsEach = 2;  // of a link: up and down
  ClientOptions client;
  client.hello.station = k == 0 ? "replay" : "replay " + std::to_string(k + 1);
  client.hello.scheme = options.scheme;
  client.hello.order = static_cast<std::uint16_t>(options.order);
  client.guard.passivity = options.passivity;
  auto device = make_device(motion, options);
  if (options.simulated_device) {
    client.guard.force_max_n = device->caps().force_max_n;
    client.guard.slew_max_n_s = device->caps().slew_max_n_s;
  }
  device->wait_for_start();
  LinkSpec link = options.link;
  link.seed += kSeedsEach * k;
  return world.add_station(client, std::move(device), link);
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

/// What the station's own counts say of its run, since those at the beginning.
void count(ReplayResult& result, WorldStation& station, std::uint64_t used_before, std::uint64_t sent_before, Micros length) {
  const ClientCore& core = station.core();
  const ClientCounts& counts = core.counts();
  result.patches_used = station.core().haptic().counts().patches_used - used_before;
  result.patch_bytes_mean =
      counts.patches > 0 ? static_cast<double>(counts.patch_bytes) / static_cast<double>(counts.patches) : 0;
  result.patch_states = core.last_patch().states();
  result.last_patch = core.last_patch();
  result.guard = station.core().haptic().guard_counts();
  result.uplink_bytes_s = static_cast<double>(counts.bytes_sent - sent_before) / seconds(length);
}

}  // namespace

ReferenceForce reference_of(const Scene& scene, const Motion& motion) {
  std::vector<Vec3> positions;
  for (Micros t{}; t <= motion.duration(); t += kTick) positions.push_back(motion.position(t));
  return reference_force(scene, positions);
}

ReplayResult replay(const Scene& scene, const Motion& motion, const ReplayOptions& options, const Stopwatch& stopwatch) {
  return replay_together(scene, std::span(&motion, 1), options, stopwatch).front();
}

std::vector<ReplayResult> replay_together(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options,
                                          const Stopwatch& stopwatch) {
  const auto n = motions.size();
  std::vector<ReplayResult> results(n);
  World world(scene, {options.rate_hz, options.compute, options.seed});
  std::vector<WorldStation*> stations;
  for (std::size_t k = 0; k < n; ++k) stations.push_back(&add_station(world, motions[k], options, k));

  Times build, frame;
  std::vector<ReplayFrame> frames;  // in world time
  world.run_frame = [&](Room& room, const FrameJob& job) {
    const auto t0 = stopwatch();
    FrameResult r = room.simulate(job);
    const auto t1 = stopwatch();
    room.build_patches(job, r);
    const auto t2 = stopwatch();
    frame.add(t2 - t0);
    if (!r.stations.empty() && r.stations[0].patch) build.add(t2 - t1);
    if (!r.stations.empty()) frames.push_back({world.now() + options.compute, r.stations[0].force});
    return r;
  };
  std::vector<std::vector<double>> tick_ns(n);
  for (std::size_t k = 0; k < n; ++k)
    stations[k]->run_tick = [&, k](HapticTick& haptic, const ToolSample& sample) {
      const auto t0 = stopwatch();
      const TickOutput out = haptic.tick(sample);
      tick_ns[k].push_back(static_cast<double>(stopwatch() - t0));
      return out;
    };

  const Micros begin = join(world, stations, scene, motions, options.scheme, options.link, options.rate_hz);
  Micros length = Micros::max();
  for (const Motion& motion : motions) length = std::min(length, motion.duration());
  const auto ticks = static_cast<std::size_t>(length / kTick) + 1;
  std::vector<ToolPath> paths(n);
  std::vector<std::vector<Swap>> swaps(n);
  std::vector<std::uint64_t> used_before(n), sent_before(n);
  for (std::size_t k = 0; k < n; ++k) {
    stations[k]->device().start(stations[k]->clock(begin));
    stations[k]->on_tick = [&, k](Micros t, const Vec3& position, const TickOutput& out) {
      auto& done = results[k].ticks;
      if (t < begin || done.size() >= ticks) return;
      if (out.swapped) swaps[k].push_back({done.size(), {out.hand_over_step_n, out.force.norm()}});
      done.push_back({position, out.force, Vec3::Zero(), out.has_patch ? out.patch_age : Micros{-1}, out.contact, false});
      paths[k].push_back(position);
    };
    tick_ns[k].clear();
    used_before[k] = stations[k]->core().haptic().counts().patches_used;
    sent_before[k] = stations[k]->core().counts().bytes_sent;
  }
  world.run_until(begin + length);

  for (const ReplayFrame& f : frames)
    if (f.t >= begin) results[0].frames.push_back({f.t - begin, f.force});
  const bool known =
      options.reference && n == 1 && !options.simulated_device && options.reference->force.size() == paths[0].size();
  const std::vector<ReferenceForce> references =
      known ? std::vector<ReferenceForce>{*options.reference} : reference_forces(scene, paths);
  for (std::size_t k = 0; k < n; ++k) {
    measure(results[k], references[k], swaps[k]);
    count(results[k], *stations[k], used_before[k], sent_before[k], length);
    results[k].tick_ns_p50 = percentile(tick_ns[k], 0.5);
    results[k].tick_ns_p99 = percentile(std::move(tick_ns[k]), 0.99);
    results[k].patch_build_ms_mean = build.mean();
    results[k].frame_ms_mean = frame.mean();
  }
  return results;
}

}  // namespace palpate
