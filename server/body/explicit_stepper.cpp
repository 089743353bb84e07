#include "server/body/explicit_stepper.hpp"

#include <algorithm>

namespace palpate {

ExplicitStepper::ExplicitStepper(const Dynamics& dynamics, const Skin& skin)
    : body_(dynamics), contacts_(skin), dynamics_(&dynamics), fallback_(dynamics, skin, {}) {}

AdvanceReport ExplicitStepper::advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                                       const ToolMotion& tools) {
  constexpr int kTries = 3;
  const double begin_s = state.time_s, whole_s = until_s - begin_s;
  if (!(whole_s > 1e-9)) return {};
  const std::vector<ToolPort> ports_before = ports;
  expected_ = {};
  int spent = 0;
  for (int tries = 0; tries < kTries; ++tries) {
    body_.take(state, ports);
    contacts_.take(state, ports);
    const Growth now = body_.growth();
    expected_ = most_ = {std::max(expected_.stiffness, now.stiffness), std::max(expected_.damping, now.damping)};
    const Steps steps = steps_for(whole_s, step_s, ports);
    if (steps.count == 0) break;
    unwatched_s_ = 0;
    go(steps, ports, begin_s, tools);
    spent += steps.count;
    const bool sound = body_.is_sound(steps.h);
    if (sound && !outgrown()) {
      body_.give(state, ports, tools, until_s);
      find_holding_forces(*dynamics_, state, ports);
      return {.steps = steps.count, .needed_share = body_.needed_share()};
    }
    ports = ports_before;
    if (body_.hexahedra().size() == 0) break;
    constexpr double kMuch = 2;
    expected_ = sound ? most_ : Growth{kMuch * expected_.stiffness, kMuch * expected_.damping};
  }
  AdvanceReport report = fallback_.advance(state, ports, until_s, step_s, tools);
  report.cut_steps += std::max(spent, 1);
  return report;
}

/// Returns true if the body stiffened so much that the steps chosen at the begin may have been too long.
bool ExplicitStepper::outgrown() {
  // Limits for a single cell. Steps stay stable if all of a body stiffens by 1.23 and its damping grows by 1.11 (kShare), and the
  // modes of one cell are slower; solids pressed, torn and released at random stay sound.
  constexpr double kStiffer = 1.4, kThicker = 1.25;
  watch(kWatchedEveryS);
  return most_.stiffness > kStiffer * expected_.stiffness || most_.damping > kThicker * expected_.damping;
}

void ExplicitStepper::watch(double h) {
  unwatched_s_ += h;
  if (body_.hexahedra().size() == 0 || unwatched_s_ < kWatchedEveryS) return;
  unwatched_s_ = 0;
  const Growth now = body_.growth();
  most_ = {std::max(most_.stiffness, now.stiffness), std::max(most_.damping, now.damping)};
}

std::vector<std::uint32_t> ExplicitStepper::busy_nodes(const std::vector<ToolPort>& ports) {
  std::vector<std::uint32_t> busy;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].kind == ContactKind::attach)
      busy.push_back(ports[k].node);
    else if (ports[k].touching)
      for (const auto& [node, weight] : contacts_.refreshed(body_, k, ports[k].point).b) busy.push_back(node);
  }
  return busy;
}

}  // namespace palpate
