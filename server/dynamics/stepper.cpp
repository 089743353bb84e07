#include "server/dynamics/stepper.hpp"

namespace palpate {

AdvanceReport& AdvanceReport::operator+=(const AdvanceReport& next) {
  steps += next.steps;
  cut_steps += next.cut_steps;
  newton_iterations += next.newton_iterations;
  touched_iterations += next.touched_iterations;
  solver_iterations += next.solver_iterations;
  factorisations += next.factorisations;
  needed_share = next.needed_share;
  converged = next.converged;
  return *this;
}

std::vector<std::uint8_t> held_nodes(const LumpedBody& body, const std::vector<ToolPort>& ports) {
  auto held = body.fixed;
  for (const ToolPort& p : ports)
    if (p.kind == ContactKind::attach) held[p.node] = 1;
  return held;
}

void find_holding_forces(const Dynamics& dynamics, const BodyState& state, std::vector<ToolPort>& ports) {
  for (ToolPort& p : ports)
    if (p.kind == ContactKind::attach) p.lambda = -dynamics.element_force(state, p.node);
}

}  // namespace palpate
