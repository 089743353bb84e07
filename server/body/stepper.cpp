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

void hold_nodes(const LumpedBody& body, const std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools,
                BodyState& state) {
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    if (!body.fixed[i]) continue;
    at_node(state.x, i) = body.nodes[i];
    at_node(state.v, i).setZero();
  }
  for (std::size_t k = 0; k < ports.size(); ++k) {
    const std::uint32_t node = ports[k].node;
    if (ports[k].kind != ContactKind::attach || body.fixed[node]) continue;
    const ToolAt tool = tools(k, at_s);
    at_node(state.x, node) = tool.position;
    at_node(state.v, node) = tool.velocity;
    if (!body.planar) continue;
    state.x[3 * node + 2] = body.nodes[node].z();
    state.v[3 * node + 2] = 0;
  }
}

}  // namespace palpate
