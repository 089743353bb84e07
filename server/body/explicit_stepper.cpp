#include "server/body/explicit_stepper.hpp"

#include <algorithm>

namespace palpate {

ExplicitStepper::ExplicitStepper(const Dynamics& dynamics, const Skin& skin)
    : body_(dynamics), contacts_(skin), dynamics_(&dynamics), fallback_(dynamics, skin, {}) {}

AdvanceReport ExplicitStepper::advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                                       const ToolMotion& tools) {
  const double begin_s = state.time_s, whole_s = until_s - begin_s;
  if (!(whole_s > 1e-9)) return {};
  const std::vector<ToolPort> ports_before = ports;
  body_.take(state, ports);
  contacts_.take(state, ports);
  const Steps steps = steps_for(whole_s, step_s, ports);
  if (steps.count > 0) {
    go(steps, ports, begin_s, tools);
    if (body_.is_sound(steps.h)) {
      body_.give(state, ports, tools, until_s);
      find_holding_forces(*dynamics_, state, ports);
      return {.steps = steps.count};
    }
  }
  ports = ports_before;
  AdvanceReport report = fallback_.advance(state, ports, until_s, step_s, tools);
  report.cut_steps += std::max(steps.count, 1);
  return report;
}

}  // namespace palpate
