#include "bench/measure/closed_loop.hpp"

#include <algorithm>

#include "bench/fidelity/join.hpp"
#include "bench/fidelity/reference.hpp"

namespace palpate {
namespace {

ClientOptions client_options(const ClosedLoopOptions& options, const DeviceCaps& caps) {
  ClientOptions client;
  client.hello.station = "loop";
  client.hello.scheme = options.scheme;
  client.hello.order = static_cast<std::uint16_t>(options.order);
  client.guard = {caps.force_max_n, caps.slew_max_n_s, options.passivity};
  return client;
}

/// Appends the device's present state, with its energies, to the ticks.
void note(const SimPhantom& device, double device_mass_kg, const Vec3& home, LoopTick tick, ClosedLoopResult& result) {
  tick.position = device.position();
  tick.velocity = device.velocity();
  tick.force = device.force();
  tick.kinetic_j = 0.5 * device_mass_kg * tick.velocity.squaredNorm();
  if (!result.ticks.empty()) {
    const LoopTick& before = result.ticks.back();
    tick.display_j = before.display_j - before.force.dot(tick.position - before.position);
  }
  result.ticks.push_back(tick);
  result.lost = (tick.position - home).norm() > kLostM;
}

}  // namespace

ClosedLoopResult closed_loop(const Scene& scene, const Motion& intention, const ClosedLoopOptions& options) {
  validate(options.link, "link");
  ClosedLoopResult result;
  World world(scene, {options.rate_hz, options.compute, options.seed});
  auto owned = std::make_unique<SimPhantom>(intention, options.device);
  const SimPhantom& device = *owned;
  const ClientOptions client = client_options(options, device.caps());
  owned->wait_for_start();
  WorldStation& station = world.add_station(client, std::move(owned), options.link);
  WorldStation* const stations[] = {&station};
  const Micros begin = join(world, stations, scene, std::span(&intention, 1), options.scheme, options.link, options.rate_hz);
  station.device().start(station.clock(begin));

  result.ticks.reserve(static_cast<std::size_t>(options.duration / kTick) + 1);
  const Vec3 home = intention.position(0.0);
  bool silent = false;  // true from a missing patch that reduces or zeroes the force until it is whole again
  station.on_tick = [&](Micros t, const Vec3&, const TickOutput& out) {
    if (t < begin || result.lost) return;
    LoopTick tick;
    tick.patch_age = out.has_patch ? out.patch_age : Micros{-1};
    tick.hand_over_step_n = out.swapped ? out.hand_over_step_n : 0;
    const double gain = out.has_patch ? out.gain : 0;
    silent = gain < 1 && (silent || out.outlived || !out.has_patch);
    if (silent) tick.gain = gain;
    note(device, options.device.device_mass_kg, home, tick, result);
  };
  const Micros end = begin + options.duration;
  constexpr Micros kLook{10'000};
  // Not world.now(), which stays at the last event.
  for (Micros until = world.now(); until < end && !result.lost;) world.run_until(until = std::min(end, until + kLook));
  result.patches_used = station.core().haptic().counts().patches_used;
  result.guard = station.core().haptic().guard_counts();
  return result;
}

ClosedLoopResult reference_loop(const Scene& scene, const Motion& intention, const SimPhantomOptions& hand, Micros duration,
                                std::span<const LoopTick> cuts) {
  ClosedLoopResult result;
  SimPhantom device(intention, hand);
  const Vec3 home = intention.position(0.0);
  ReferenceModel model(scene, std::span(&home, 1));
  for (Micros t{}; t <= duration && !result.lost; t += kTick) {
    const Vec3 tool = device.read(t).position;
    model.tick(std::span(&tool, 1));
    LoopTick tick;
    if (result.ticks.size() < cuts.size()) tick.gain = cuts[result.ticks.size()].gain;
    device.write(tick.gain * model.force(0));
    note(device, hand.device_mass_kg, home, tick, result);
  }
  return result;
}

}  // namespace palpate
