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
    const HexaForces::Growth before = body_.growth();
    go(steps, ports, begin_s, tools);
    if (body_.is_sound(steps.h) && !outgrown(before)) {
      body_.give(state, ports, tools, until_s);
      find_holding_forces(*dynamics_, state, ports);
      return {.steps = steps.count, .needed_share = body_.needed_share()};
    }
  }
  ports = ports_before;
  if (steps.count > 1 && body_.hexahedra().size() > 0 && whole_s > kShortestFrameS) {
    AdvanceReport report = advance(state, ports, begin_s + whole_s / 2, step_s, tools);
    const AdvanceReport rest = advance(state, ports, until_s, step_s, tools);
    report.steps += rest.steps;
    report.cut_steps += rest.cut_steps;
    report.newton_iterations += rest.newton_iterations;
    report.solver_iterations += rest.solver_iterations;
    report.factorisations += rest.factorisations;
    report.converged = report.converged && rest.converged;
    return report;
  }
  AdvanceReport report = fallback_.advance(state, ports, until_s, step_s, tools);
  report.cut_steps += std::max(steps.count, 1);
  return report;
}

/// Whether the body became so much stiffer on the way that the steps chosen at its beginning may have been too long for it.
bool ExplicitStepper::outgrown(const HexaForces::Growth& before) const {
  constexpr double kStiffer = 1.4, kThicker = 1.25;  // less than what steps keep free
  if (body_.hexahedra().size() == 0) return false;
  const HexaForces::Growth now = body_.growth();
  return now.stiffness > kStiffer * before.stiffness || now.damping > kThicker * before.damping;
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
