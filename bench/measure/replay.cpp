#include "bench/measure/replay.hpp"

#include <algorithm>
#include <stdexcept>

#include "bench/measure/reference.hpp"
#include "client/device/replay_device.hpp"
#include "client/device/sim_phantom.hpp"
#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr Micros kJoinWithin{10'000'000};

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

}  // namespace

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
  std::vector<std::vector<double>> tick_ns(n);
  std::vector<std::uint8_t> has_patch(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    stations[k]->run_tick = [&, k](HapticTick& haptic, const ToolSample& sample) {
      const auto t0 = stopwatch();
      const TickOutput out = haptic.tick(sample);
      tick_ns[k].push_back(static_cast<double>(stopwatch() - t0));
      return out;
    };
    stations[k]->on_tick = [&, k](Micros, const Vec3&, const TickOutput& out) { has_patch[k] = out.has_patch; };
  }

  // Join and, for a grasp, wait for the first patch; then let what the grasp disturbed die out.
  const bool wants_patch = scene.tool.contact == ContactKind::attach;
  const auto waits = [&](std::size_t k) {
    const ClientCore& core = stations[k]->core();
    if (core.link() == LinkState::refused)
      throw InputError("--scheme " + std::string(name_of(options.scheme)), "refused by the server: " + core.refusal(),
                       "a scheme and order that it takes");
    return core.link() != LinkState::joined || (wants_patch && !has_patch[k]);
  };
  for (std::size_t k = 0; k < n; ++k)
    while (waits(k)) {
      if (world.now() > kJoinWithin) throw std::runtime_error("no answer over this link within 10 s of virtual time");
      world.run_until(world.now() + Micros{1000});
    }
  bool settle = false;
  Micros length = Micros::max();
  for (const Motion& motion : motions) {
    settle |= needs_settling(scene, motion.position(0.0));
    length = std::min(length, motion.duration());
  }
  if (settle) world.run_until(world.now() + kSettle);

  // Time 0 of the motion lies on a frame, so that equal runs at other rates and delays compare the same phases.
  const Micros frame_length = from_seconds(1 / options.rate_hz);
  const Micros begin = (world.now() / frame_length + 1) * frame_length;
  const auto ticks = static_cast<std::size_t>(length / kTick) + 1;
  std::vector<ToolPath> paths(n);
  std::vector<std::uint64_t> used_before(n);
  for (std::size_t k = 0; k < n; ++k) {
    stations[k]->device().start(stations[k]->clock(begin));
    stations[k]->on_tick = [&, k](Micros t, const Vec3& position, const TickOutput& out) {
      if (t < begin || results[k].ticks.size() >= ticks) return;
      results[k].ticks.push_back({position, out.force, Vec3::Zero(), out.has_patch ? out.patch_age : Micros{-1}, out.contact});
      paths[k].push_back(position);
    };
    tick_ns[k].clear();
    used_before[k] = stations[k]->core().haptic().counts().patches_used;
  }
  world.run_until(begin + length);

  const std::vector<ReferenceForce> references = reference_forces(scene, paths);
  for (std::size_t k = 0; k < n; ++k) {
    ReplayResult& result = results[k];
    const ClientCore& core = stations[k]->core();
    std::vector<Vec3> felt;
    for (std::size_t i = 0; i < result.ticks.size(); ++i) {
      result.ticks[i].reference = references[k].force[i];
      felt.push_back(result.ticks[i].felt);
    }
    result.fidelity = compare(felt, references[k].force, kSkipTicks);
    const ClientCounts& counts = core.counts();
    const HapticCounts& haptic = stations[k]->core().haptic().counts();
    result.patches_used = haptic.patches_used - used_before[k];
    result.patch_bytes_mean =
        counts.patches > 0 ? static_cast<double>(counts.patch_bytes) / static_cast<double>(counts.patches) : 0;
    result.patch_states = core.last_patch().states();
    result.hand_over_step_max_n = haptic.hand_over_step_max_n;
    result.tick_ns_p50 = percentile(tick_ns[k], 0.5);
    result.tick_ns_p99 = percentile(std::move(tick_ns[k]), 0.99);
    result.patch_build_ms_mean = build.mean();
    result.frame_ms_mean = frame.mean();
  }
  return results;
}

}  // namespace palpate
