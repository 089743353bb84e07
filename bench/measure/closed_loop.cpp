#include "bench/measure/closed_loop.hpp"

#include <algorithm>

#include "bench/fidelity/join.hpp"
#include "bench/fidelity/reference.hpp"

namespace palpate {
namespace {

ClientOptions client_options(const ClosedLoopOptions& options, const DeviceCaps& caps) {
  ClientOptions client;
  client.hello.scheme = options.scheme;
  client.hello.order = static_cast<std::uint16_t>(options.order);
  client.guard = {caps.force_max_n, caps.slew_max_n_s, options.passivity};
  client.guard.renders_torque = caps.renders_torque;
  client.guard.torque_max_nm = caps.torque_max_nm;
  client.guard.torque_slew_max_nm_s = caps.torque_slew_max_nm_s;
  return client;
}

/// Appends the device's present state, with its energies, to the ticks.
void note(const SimPhantom& device, const SimPhantomOptions& options, const Vec3& home, LoopTick tick, ClosedLoopResult& result) {
  tick.position = device.position();
  tick.velocity = device.velocity();
  tick.turn = device.turn();
  tick.force = device.force();
  tick.torque = device.torque();
  tick.kinetic_j = 0.5 * options.device_mass_kg * tick.velocity.squaredNorm();
  if (options.wrist) tick.kinetic_j += 0.5 * options.wrist->device_inertia_kg_m2 * device.spin().squaredNorm();
  if (!result.ticks.empty()) {
    const LoopTick& before = result.ticks.back();
    tick.display_j = before.display_j - before.force.dot(tick.position - before.position) -
                     before.torque.dot(rotation_between(before.turn, tick.turn));
  }
  result.ticks.push_back(tick);
  result.lost = (tick.position - home).norm() > kLostM;
}

std::string station_name(std::size_t k) { return k == 0 ? "loop" : "loop " + std::to_string(k + 1); }

bool any_lost(const std::vector<ClosedLoopResult>& results) {
  return std::ranges::any_of(results, [](const ClosedLoopResult& result) { return result.lost; });
}

/// A hand of a running loop.
struct Running {
  const SimPhantom* device = nullptr;
  WorldStation* station = nullptr;
  Vec3 home;
  bool silent = false;  ///< true from a missing patch that reduces or zeroes the force until it is whole again
};

/// Adds the station of a hand, whose device waits for its start.
Running add_hand(World& world, const LoopHand& hand, std::size_t k, const ClosedLoopOptions& options) {
  auto device = std::make_unique<SimPhantom>(hand.intention, hand.device);
  Running running{device.get(), nullptr, hand.intention.position(0.0)};
  ClientOptions client = client_options(options, device->caps());
  client.hello.station = station_name(k);
  if (hand.guides) client.hello.guides = station_name(*hand.guides);
  device->wait_for_start();
  running.station = &world.add_station(client, std::move(device), hand.link);
  return running;
}

/// Returns the tick without the device's state.
LoopTick tick_of(const TickOutput& out, bool& silent) {
  LoopTick tick;
  tick.patch_age = out.has_patch ? out.patch_age : Micros{-1};
  tick.guidance = out.guidance;
  tick.hand_over_step_n = out.swapped ? out.hand_over_step_n : 0;
  const double gain = out.has_patch ? out.gain : 0;
  silent = gain < 1 && (silent || out.outlived || !out.has_patch);
  if (silent) tick.gain = gain;
  return tick;
}

}  // namespace

std::vector<ClosedLoopResult> closed_loop(const Scene& scene, std::span<const LoopHand> hands, const ClosedLoopOptions& options) {
  std::vector<ClosedLoopResult> results(hands.size());
  World world(scene, {options.rate_hz, options.compute, options.seed});
  std::vector<Running> running;
  std::vector<WorldStation*> stations;
  std::vector<Motion> motions;
  LinkSpec slowest;
  for (std::size_t k = 0; k < hands.size(); ++k) {
    validate(hands[k].link, "link");
    if (k == 0 || hands[k].link.latency > slowest.latency) slowest = hands[k].link;
    running.push_back(add_hand(world, hands[k], k, options));
    stations.push_back(running.back().station);
    motions.push_back(hands[k].intention);
  }
  const Micros begin = join(world, stations, scene, motions, options.scheme, slowest, options.rate_hz);
  for (std::size_t k = 0; k < hands.size(); ++k) {
    results[k].ticks.reserve(static_cast<std::size_t>(options.duration / kTick) + 1);
    stations[k]->device().start(stations[k]->clock(begin));
    stations[k]->on_tick = [&, k](Micros t, const Vec3&, const TickOutput& out) {
      if (t < begin || results[k].lost) return;
      const LoopTick tick = tick_of(out, running[k].silent);
      note(*running[k].device, hands[k].device, running[k].home, tick, results[k]);
    };
  }
  const Micros end = begin + options.duration;
  constexpr Micros kLook{10'000};
  // Not world.now(), which stays at the last event.
  for (Micros until = world.now(); until < end && !any_lost(results);) world.run_until(until = std::min(end, until + kLook));
  for (std::size_t k = 0; k < hands.size(); ++k) {
    results[k].patches_used = stations[k]->core().haptic().counts().patches_used;
    results[k].guard = stations[k]->core().haptic().guard_counts();
    results[k].haptic = stations[k]->core().haptic().counts();
    results[k].guidance_reach = stations[k]->core().haptic().guidance().reach;
  }
  return results;
}

std::vector<ClosedLoopResult> reference_loop(const Scene& scene, std::span<const LoopHand> hands, Micros duration,
                                             std::span<const ClosedLoopResult> cuts) {
  std::vector<ClosedLoopResult> results(hands.size());
  std::vector<std::unique_ptr<SimPhantom>> devices;
  std::vector<Vec3> homes;
  for (const LoopHand& hand : hands) {
    devices.push_back(std::make_unique<SimPhantom>(hand.intention, hand.device));
    homes.push_back(hand.intention.position(0.0));
  }
  ReferenceModel model(scene, homes);
  std::vector<Vec3> tools = homes;
  std::vector<Rotation> turns(scene.tool.has_body() ? hands.size() : 0);
  for (Micros t{}; t <= duration && !any_lost(results); t += kTick) {
    for (std::size_t k = 0; k < hands.size(); ++k) {
      const DeviceReading reading = devices[k]->read(t);
      tools[k] = reading.position;
      if (!turns.empty()) turns[k] = Rotation(reading.orientation);
    }
    model.tick(tools, turns);
    for (std::size_t k = 0; k < hands.size(); ++k) {
      LoopTick tick;
      const std::size_t n = results[k].ticks.size();
      if (k < cuts.size() && n < cuts[k].ticks.size()) tick.gain = cuts[k].ticks[n].gain;
      devices[k]->write(Wrench(tick.gain * model.force(k), tick.gain * model.torque(k)));
      note(*devices[k], hands[k].device, homes[k], tick, results[k]);
    }
  }
  return results;
}

}  // namespace palpate
