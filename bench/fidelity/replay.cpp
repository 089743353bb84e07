#include "bench/fidelity/replay.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "bench/fidelity/join.hpp"
#include "bench/fidelity/reference.hpp"
#include "client/device/replay_device.hpp"
#include "client/device/sim_phantom.hpp"
#include "common/base/rotation_vector.hpp"

namespace palpate {
namespace {

std::unique_ptr<MotionDevice> make_device(const Motion& motion, const ReplayOptions& options) {
  if (!options.simulated_device) return std::make_unique<ReplayDevice>(motion);
  SimPhantomOptions phantom;
  phantom.seed = options.seed;
  return std::make_unique<SimPhantom>(motion, phantom);
}

std::string station_name(std::size_t k) { return k == 0 ? "replay" : "replay " + std::to_string(k + 1); }

/// Adds the k-th station of a replay; the first is the same as in a replay with one station.
WorldStation& add_station(World& world, const Scene& scene, const Motion& motion, const ReplayOptions& options, std::size_t k) {
  constexpr std::uint64_t kSeedsEach = 2;  // seeds per link: up and down
  ClientOptions client;
  client.hello.station = station_name(k);
  client.hello.scheme = options.scheme;
  client.hello.order = static_cast<std::uint16_t>(options.order);
  const ToolSpec& tool = scene.tool_of(options.held.empty() ? 0 : options.held.at(k));
  client.hello.tool = tool.name;
  client.guard.passivity = options.passivity;
  client.guard.renders_torque = tool.has_body() && !options.simulated_device;
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

/// Time spent in each phase of building patches.
class PhaseTimes {
 public:
  explicit PhaseTimes(const Stopwatch& stopwatch) : stopwatch_(stopwatch) {}
  void enter(BuildPhase phase) {
    const std::int64_t now = stopwatch_();
    ns_[static_cast<std::size_t>(phase_)] += static_cast<double>(now - entered_ns_);
    phase_ = phase;
    entered_ns_ = now;
  }
  void begin() {
    phase_ = BuildPhase::other;
    entered_ns_ = stopwatch_();
  }
  std::array<double, kPatchParts> mean_ms(std::uint64_t frames) const {
    std::array<double, kPatchParts> mean{};
    for (std::size_t k = 0; k < kPatchParts && frames > 0; ++k) mean[k] = 1e-6 * ns_[k] / static_cast<double>(frames);
    return mean;
  }

 private:
  const Stopwatch& stopwatch_;
  BuildPhase phase_ = BuildPhase::other;
  std::int64_t entered_ns_ = 0;
  std::array<double, kPatchParts> ns_{};
};

/// For each swap: the largest change of force from tick to tick within its cross-fade, beyond the reference's own.
std::vector<HandOver> felt_steps(const std::vector<ReplayTick>& ticks, const std::vector<ReplaySwap>& swaps) {
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

/// Compares the ticks from kSkipTicks on that are scored.
Fidelity fidelity_of(const std::vector<Vec3>& felt, const std::vector<Vec3>& reference, const std::vector<std::uint8_t>& scored) {
  if (scored.empty()) return compare(felt, reference, kSkipTicks);
  std::vector<Vec3> felt_there, reference_there;
  for (std::size_t i = kSkipTicks; i < std::min(felt.size(), scored.size()); ++i) {
    if (!scored[i]) continue;
    felt_there.push_back(felt[i]);
    reference_there.push_back(reference[i]);
  }
  return compare(felt_there, reference_there, 0);
}

void measure(ReplayResult& result, const ReferenceForce& reference, const std::vector<std::uint8_t>& scored) {
  std::vector<Vec3> felt, felt_torque, felt_grip, reference_grip;
  std::vector<std::uint8_t> contact;
  std::vector<double> ages_us;
  const bool has_torque = !reference.torque.empty();
  for (std::size_t i = 0; i < result.ticks.size(); ++i) {
    ReplayTick& tick = result.ticks[i];
    tick.reference = reference.force[i];
    tick.true_contact = reference.contact[i] != 0;
    if (!reference.tip.empty()) tick.reference_tip = reference.tip[i];
    if (has_torque) {
      tick.reference_torque = reference.torque[i];
      felt_torque.push_back(tick.felt_torque);
    }
    if (!reference.grip.empty()) {
      tick.reference_grip = reference.grip[i];
      felt_grip.emplace_back(tick.felt_grip, 0, 0);
      reference_grip.emplace_back(tick.reference_grip, 0, 0);
    }
    felt.push_back(tick.felt);
    contact.push_back(tick.contact);
    if (tick.patch_age >= Micros{}) ages_us.push_back(static_cast<double>(tick.patch_age.count()));
  }
  result.fidelity = fidelity_of(felt, reference.force, scored);
  constexpr double kLeastTorqueNm = 1e-6;  // a thousandth of what a device renders: less is rounding
  if (std::ranges::any_of(reference.torque, [](const Vec3& torque) { return torque.norm() > kLeastTorqueNm; }))
    result.torque = fidelity_of(felt_torque, reference.torque, scored);
  if (!reference_grip.empty()) result.grip = fidelity_of(felt_grip, reference_grip, scored);
  result.onset = onset_errors(contact, reference.contact);
  std::vector<HandOver> between;
  for (const ReplaySwap& swap : result.swaps) between.push_back(swap.between);
  result.hand_over = hand_over_steps(between);
  result.felt_step = hand_over_steps(felt_steps(result.ticks, result.swaps));
  result.age_p95 = from_seconds(1e-6 * percentile(std::move(ages_us), 0.95));
}

/// Replaces the patches of a frame by those that `make` makes of the same states.
void replace_patches(const Room& room, const FrameJob& job, const PatchMaker& make, FrameResult& result) {
  for (std::size_t k = 0; k < result.stations.size(); ++k) {
    StationFrame& station = result.stations[k];
    const auto origin = station.patch ? room.origin(station.id) : std::nullopt;
    if (!origin) continue;  // no patch, or the fading force of a released tool
    assert(job.stations[k].id == station.id);
    station.patch = make(*origin, *station.patch, job.stations[k].horizon);
  }
}

/// Replaces the felt force f of each tick by y, y' = 2 pi f_c (f - y).
void low_pass(double cut_off_hz, std::vector<ReplayTick>& ticks) {
  const double gain = 1 - std::exp(-2 * std::numbers::pi * cut_off_hz / kHapticRateHz);
  for (std::size_t i = 1; i < ticks.size(); ++i) ticks[i].felt = ticks[i - 1].felt + gain * (ticks[i].felt - ticks[i - 1].felt);
}

/// Replaces what is felt, which is held, by what the proxy renders.
void couple(const StaticJacobian& proxy, std::vector<ReplayTick>& ticks) {
  std::vector<Wrench> felt(ticks.size());
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const ReplayTick& now = ticks[i];
    if (now.patch_age < Micros{} || now.felt.isZero(0)) continue;
    const ReplayTick& then = ticks[i - std::min(i, static_cast<std::size_t>(now.patch_age / kTick))];
    felt[i] = {now.felt - proxy.stiffness_n_m * (now.position - then.position),
               now.felt_torque -
                   proxy.stiffness_n_m * proxy.radius_m * proxy.radius_m * rotation_vector(now.turn * then.turn.inverse())};
  }
  for (std::size_t i = 0; i < ticks.size(); ++i) ticks[i].felt = felt[i].force, ticks[i].felt_torque = felt[i].torque;
}

/// Times of a frame that gets a share of a core: the step's grows with the time that it covers, patches have that of their
/// scheme, and those of `hyper` share the rollouts. A held force takes no time.
FrameTimes times_of(const FrameCost& cost, double rate_hz, const FrameJob& job, const FrameResult& result) {
  const FrameCosts::Expected wall = expected_costs(cost, cost.core_share);
  FrameTimes times{.step = from_seconds(seconds(wall.step) * rate_hz * seconds(result.stamp - job.begin))};
  for (const StationFrame& station : result.stations) {
    if (!station.patch || station.patch->scheme == Scheme::hold) continue;
    const bool nonlinear = station.patch->scheme == Scheme::hyper;
    times.patches += nonlinear ? wall.nonlinear : wall.linear;
    if (nonlinear && job.rollouts) times.rollouts = wall.rollouts;
  }
  times.patches += times.rollouts;
  return times;
}

/// Counters that grow during a run.
struct Tally {
  std::uint64_t patches_used = 0, faded_ticks = 0, bytes_sent = 0, bytes_received = 0;
};

Tally tally_of(const World& world, std::size_t k) {
  const ClientCore& core = world.station(k).core();
  const HapticCounts& haptic = core.haptic().counts();
  return {haptic.patches_used, haptic.faded_ticks, core.counts().bytes_sent, core.counts().bytes_received};
}

/// Adds the station's and the server's counts since `before` to the result.
void count(ReplayResult& result, const World& world, std::size_t k, const Tally& before, Micros length) {
  const Tally after = tally_of(world, k);
  const ClientCore& core = world.station(k).core();
  result.patches_used = after.patches_used - before.patches_used;
  result.faded_ticks = after.faded_ticks - before.faded_ticks;
  result.patch_bytes_mean = core.patch_bytes_mean();
  result.patch_states = core.last_patch().states();
  result.last_patch = core.last_patch();
  result.guard = core.haptic().guard_counts();
  result.uplink_bytes_s = static_cast<double>(after.bytes_sent - before.bytes_sent) / seconds(length);
  result.downlink_bytes_s = static_cast<double>(after.bytes_received - before.bytes_received) / seconds(length);
}

}  // namespace

std::vector<ReferenceForce> references_of(std::span<const ReplayResult> results) {
  std::vector<ReferenceForce> references(results.size());
  for (std::size_t k = 0; k < results.size(); ++k) {
    const std::vector<ReplayTick>& ticks = results[k].ticks;
    const bool has_torque =
        std::any_of(ticks.begin(), ticks.end(), [](const ReplayTick& tick) { return !tick.reference_torque.isZero(0); });
    const bool has_tip =
        std::any_of(ticks.begin(), ticks.end(), [](const ReplayTick& tick) { return tick.reference_tip.front_m > 0; });
    const bool has_grip =
        std::any_of(ticks.begin(), ticks.end(), [](const ReplayTick& tick) { return tick.reference_grip != 0; });
    for (const ReplayTick& tick : ticks) {
      if (has_grip) references[k].grip.push_back(tick.reference_grip);
      references[k].force.push_back(tick.reference);
      references[k].contact.push_back(tick.true_contact ? 1 : 0);
      if (has_torque) references[k].torque.push_back(tick.reference_torque);
      if (has_tip) references[k].tip.push_back(tick.reference_tip);
    }
  }
  return references;
}

std::vector<double> relative_errors(const ReplayResult& result) {
  std::vector<Vec3> felt, reference;
  for (const ReplayTick& tick : result.ticks) {
    felt.push_back(tick.felt);
    reference.push_back(tick.reference);
  }
  return relative_errors(felt, reference);
}

ReferenceForce reference_of(const Scene& scene, const Motion& motion) {
  std::vector<Vec3> positions;
  ToolTurns turns;
  ToolOpenings openings;
  for (Micros t{}; t <= motion.duration(); t += kTick) {
    positions.push_back(motion.position(t));
    if (motion.has_orientation()) turns.push_back(*motion.orientation(t));
    if (motion.has_opening()) openings.push_back(motion.opening(t));
  }
  return reference_force(scene, positions, turns, openings);
}

ReplayResult replay(const Scene& scene, const Motion& motion, const ReplayOptions& options, const Stopwatch& stopwatch) {
  return replay_together(scene, std::span(&motion, 1), options, stopwatch).front();
}

std::vector<ReplayResult> replay_together(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options,
                                          const Stopwatch& stopwatch) {
  const auto n = motions.size();
  std::vector<ReplayResult> results(n);
  WorldOptions in{.rate_hz = options.rate_hz, .compute = options.compute, .seed = options.seed, .deadband = options.deadband};
  if (options.cost) {
    in.expected_costs = expected_costs(*options.cost, 1);
    in.frame_times = [&](Micros, const FrameJob& job, const FrameResult& result) {
      return times_of(*options.cost, options.rate_hz, job, result);
    };
  }
  World world(scene, in);
  std::vector<WorldStation*> stations;
  for (std::size_t k = 0; k < n; ++k) stations.push_back(&add_station(world, scene, motions[k], options, k));

  Times build, frame;
  PhaseTimes phases(stopwatch);
  std::vector<ReplayFrame> frames;  // times in world time
  Micros begin = Micros::max();     // begin of the motions, in world time
  std::span<const Micros> resets = options.resets;
  world.run_frame = [&](Room& room, const FrameJob& due) {
    FrameJob job = due;
    for (; !resets.empty() && begin <= world.now() - resets.front(); resets = resets.subspan(1)) job.reset = true;
    const auto t0 = stopwatch();
    FrameResult r = room.simulate(job);
    const auto t1 = stopwatch();
    room.listen([&](BuildPhase phase) { phases.enter(phase); });
    phases.begin();
    room.build_patches(job, r);
    if (options.make_patch) replace_patches(room, job, options.make_patch, r);
    phases.enter(BuildPhase::other);
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

  begin = join(world, stations, scene, motions, options.scheme, options.link, options.rate_hz);
  Micros length = Micros::max();
  for (const Motion& motion : motions) length = std::min(length, motion.duration());
  const auto ticks = static_cast<std::size_t>(length / kTick) + 1;
  std::vector<ToolPath> paths(n);
  std::vector<ToolTurns> turns(n);
  std::vector<ToolOpenings> openings(n);
  std::vector<Tally> before(n);
  for (std::size_t k = 0; k < n; ++k) {
    stations[k]->device().start(stations[k]->clock(begin));
    stations[k]->on_tick = [&, k](Micros t, const Vec3& position, const TickOutput& out) {
      auto& done = results[k].ticks;
      if (t < begin || done.size() >= ticks) return;
      if (out.swapped) results[k].swaps.push_back({done.size(), {out.hand_over_step_n, out.force.norm()}});
      const Orientation turn = motions[k].orientation(t - begin);
      done.push_back({position,
                      out.force,
                      Vec3::Zero(),
                      out.has_patch ? out.patch_age : Micros{-1},
                      out.contact,
                      false,
                      turn.value_or(Rotation::Identity()),
                      out.torque,
                      Vec3::Zero(),
                      out.tip,
                      {},
                      motions[k].opening(t - begin),
                      out.grip});
      paths[k].push_back(position);
      turns[k].push_back(done.back().turn);
      openings[k].push_back(done.back().opening);
      if (options.progress && k == 0)
        options.progress("what the hand feels", static_cast<double>(done.size()) / static_cast<double>(ticks));
    };
    tick_ns[k].clear();
    before[k] = tally_of(world, k);
  }
  world.run_until(begin + length);

  for (const ReplayFrame& f : frames)
    if (f.t >= begin) results[0].frames.push_back({f.t - begin, f.force});
  const auto full_model_progress = [&](double share) {
    if (options.progress) options.progress("the full model at 1 kHz", share);
  };
  const bool known =
      options.references.size() == n && !options.simulated_device && options.references[0].force.size() == paths[0].size();
  const std::vector<ReferenceForce> references =
      known ? std::vector<ReferenceForce>(options.references.begin(), options.references.end())
            : reference_forces(scene, paths, options.resets, full_model_progress, turns, openings, options.held);
  for (std::size_t k = 0; k < n; ++k) {
    if (options.low_pass_hz > 0) low_pass(options.low_pass_hz, results[k].ticks);
    if (options.jacobian) couple(*options.jacobian, results[k].ticks);
    measure(results[k], references[k], k == 0 ? options.scored : std::vector<std::uint8_t>{});
    count(results[k], world, k, before[k], length);
    results[k].tick_ns_p50 = percentile(tick_ns[k], 0.5);
    results[k].tick_ns_p99 = percentile(std::move(tick_ns[k]), 0.99);
    results[k].patch_build_ms_mean = build.mean();
    results[k].frame_ms_mean = frame.mean();
    results[k].phase_ms_mean = phases.mean_ms(build.count);
  }
  return results;
}

}  // namespace palpate
