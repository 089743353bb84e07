#include "server/body/stepper.hpp"

namespace palpate {

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
