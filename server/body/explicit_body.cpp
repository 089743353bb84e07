#include "server/body/explicit_body.hpp"

#include <algorithm>

#include "common/base/limits.hpp"

namespace palpate {

ExplicitBody::ExplicitBody(const Dynamics& dynamics)
    : u(dynamics.nodes()),
      v(dynamics.nodes()),
      f(dynamics.nodes()),
      dynamics_(&dynamics),
      springs_(dynamics.body()),
      spacing_m_(mean_edge_m(dynamics.body())),
      nowhere_(u.x.size(), 0.0F) {}

void ExplicitBody::employ(Crew& crew) { crew_ = crew.size() > 1 && springs_.size() >= kWorthSharing ? &crew : nullptr; }

node_loops::Nodes ExplicitBody::nodes_of(std::size_t part) const {
  const std::size_t blocks = u.x.size() / NodeArrays::kBlock, parts = node_parts();
  return {NodeArrays::kBlock * (part * blocks / parts), NodeArrays::kBlock * ((part + 1) * blocks / parts)};
}

void ExplicitBody::take(const BodyState& state, const std::vector<ToolPort>& ports) {
  const std::vector<std::uint8_t> held = held_nodes(body(), ports);
  inverse_mass_.assign(NodeArrays::padded(dynamics_->nodes()), 0.0F);
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    inverse_mass_[i] = held[i] ? 0.0F : static_cast<float>(1 / body().masses_kg[i]);
    u.set(i, at_node(state.x, i) - body().nodes[i]);
    v.set(i, at_node(state.v, i));
  }
}

void ExplicitBody::give(BodyState& state, const std::vector<ToolPort>& ports, const ToolMotion& tools, double until_s) const {
  const double over_s = std::min(kHeldOverS, until_s - state.time_s);
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i) {
    if (body().fixed[i]) continue;
    at_node(state.x, i) = body().nodes[i] + u.at(i);
    at_node(state.v, i) = v.at(i);
  }
  for (std::size_t k = 0; k < ports.size(); ++k) {
    const std::uint32_t node = ports[k].node;
    if (!is_held(ports[k])) continue;
    Vec3 to = tools(k, until_s).position, velocity = (to - tools(k, until_s - over_s).position) / over_s;
    if (body().planar) to.z() = body().nodes[node].z(), velocity.z() = 0;
    at_node(state.x, node) = to;
    at_node(state.v, node) = velocity;
  }
  state.time_s = until_s;
}

void ExplicitBody::add_forces(const NodeArrays& at_u, const NodeArrays& at_v) {
  for (const auto* slabs : {&springs_.even_slabs(), &springs_.odd_slabs()})
    share(slabs->size(), [&](std::size_t k) { springs_.add_forces((*slabs)[k], at_u, at_v, f); });
}

void ExplicitBody::accelerate(NodeArrays& a) {
  share(node_parts(), [&](std::size_t part) {
    const node_loops::Nodes nodes = nodes_of(part);
    const Vec3& gravity = body().gravity_m_s2;
    node_loops::accelerate(nodes, inverse_mass_, f.x, static_cast<float>(gravity.x()), a.x);
    node_loops::accelerate(nodes, inverse_mass_, f.y, static_cast<float>(gravity.y()), a.y);
    node_loops::accelerate(nodes, body().planar ? nowhere_ : inverse_mass_, f.z, static_cast<float>(gravity.z()), a.z);
  });
}

Vec3 ExplicitBody::displacement(std::uint32_t node, const Vec3& to) const {
  Vec3 way = to - body().nodes[node];
  if (body().planar) way.z() = 0;
  return way;
}

bool ExplicitBody::is_sound(double h) const {
  for (std::uint32_t i = 0; i < dynamics_->nodes(); ++i)
    if (!(u.at(i).norm() <= kWorldExtentM && h * v.at(i).norm() <= spacing_m_)) return false;
  return true;
}

}  // namespace palpate
