// Describes a scenario on a page.
#include <fmt/format.h>

#include <iterator>

#include "bench/world/scenario.hpp"

namespace palpate {
namespace {

std::string describe(const LinkSpec& link) {
  std::string text = fmt::format("{:.1f} ms", 1e3 * seconds(link.latency));
  if (link.jitter > Micros{}) text += fmt::format(" +- {:.1f}", 1e3 * seconds(link.jitter));
  if (link.loss > 0) text += fmt::format(", {:.1f} % lost", 100 * link.loss);
  if (link.loss > 0 && link.burst_mean > 0) text += fmt::format(" in bursts of {:.1f}", link.burst_mean);
  if (link.duplicate > 0) text += fmt::format(", {:.1f} % twice", 100 * link.duplicate);
  if (link.reorder > 0) text += fmt::format(", {:.1f} % out of order", 100 * link.reorder);
  return text;
}

std::string describe(const Scenario& s, const StationPlan& plan) {
  const Hello& hello = plan.client.hello;
  std::string what;
  if (hello.role == Role::viewer)
    what = "looks on";
  else if (plan.owner >= 0)
    what = "feels with the tool of " + s.stations[static_cast<std::size_t>(plan.owner)].client.hello.station;
  else if (!plan.simulated)
    what = "a recorded motion";
  else
    what = fmt::format("a Phantom in a {} hand, tremor {:.2f} mm", plan.hand, 1e3 * plan.phantom.tremor_m);
  if (plan.pushes() && plan.simulated && plan.phantom.release_s < 1e6)
    what += fmt::format(", lets go at {:.3f} s", plan.phantom.release_s);
  if (hello.role == Role::haptic)
    what +=
        fmt::format("; {} with {} states", name_of(hello.scheme), hello.order > 0 ? std::to_string(hello.order) : "the default");
  return fmt::format("  {:<12} {}\n  {:<12} up {}; down {}; clock {:+.0f} ppm\n", hello.station, what, "", describe(plan.up),
                     describe(plan.down), plan.drift_ppm);
}

std::string describe(const Scenario& s, const Fault& f) {
  const std::string who = f.station < 0 ? "" : s.stations[static_cast<std::size_t>(f.station)].client.hello.station + ": ";
  std::string how;
  switch (f.kind) {
    case FaultKind::storm:
      how = fmt::format(", {:.0f} % lost in bursts of 8", 100 * f.amount);
      break;
    case FaultKind::path_change:
      return fmt::format("  {:7.3f} s          {}{} to {:.1f} ms each way\n", seconds(f.begin), who, palpate::describe(f.kind),
                         1e3 * f.amount);
    case FaultKind::clock_step:
    case FaultKind::server_clock_step:
      return fmt::format("  {:7.3f} s          {}{} by {:.1f} ms\n", seconds(f.begin), who, palpate::describe(f.kind),
                         1e3 * f.amount);
    case FaultKind::server_restart:
      how = f.amount > 0 ? ", comes back with the body as it was" : ", comes back with the body at rest";
      break;
    default:
      break;
  }
  return fmt::format("  {:7.3f} - {:.3f} s  {}{}{}\n", seconds(f.begin), seconds(f.end), who, palpate::describe(f.kind), how);
}

}  // namespace

std::string describe(const Scenario& s) {
  std::string text = fmt::format("seed {}\n{}server: {:g} Hz, {:.1f} ms a frame, clock {:+.0f} ppm\nstations:\n",
                                 s.drawn_with.seed, s.scene_json, s.rate_hz, 1e3 * seconds(s.compute), s.server_drift_ppm);
  for (const StationPlan& plan : s.stations) text += describe(s, plan);
  text += "faults:\n";
  for (const Fault& f : s.faults) text += describe(s, f);
  if (s.faults.empty()) text += "  none\n";
  return text + fmt::format("healed at {:.3f} s, hands rest from {:.3f} s, ends at {:.3f} s\n", seconds(s.healed),
                            seconds(s.rest), seconds(s.end));
}

}  // namespace palpate
