#include "server/dynamics/explicit_body.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/limits.hpp"
#include "server/body/spectrum.hpp"

namespace palpate {

ExplicitBody::ExplicitBody(const Dynamics& dynamics)
    : u(dynamics.nodes()),
      v(dynamics.nodes()),
      f(dynamics.nodes()),
      dynamics_(&dynamics),
      springs_(dynamics.body()),
      hexahedra_(dynamics),
      blocks_(springs_),
      spacing_m_(mean_edge_m(dynamics.body())),
      nowhere_(u.x.size(), 0.0F) {}

void ExplicitBody::use_threads(ThreadPool& pool) {
  const bool worth_it = springs_.size() >= kWorthSharing || hexahedra_.size() >= kHexaWorthSharing;
  pool_ = pool.size() > 1 && worth_it ? &pool : nullptr;
}

node_loops::Nodes ExplicitBody::nodes_of(std::size_t part) const {
  const std::size_t blocks = u.x.size() / NodeArrays::kBlock, parts = node_parts();
  return {NodeArrays::kBlock * (part * blocks / parts), NodeArrays::kBlock * ((part + 1) * blocks / parts)};
}

void ExplicitBody::take(const BodyState& state, const std::vector<ToolPort>& ports) {
  blocks_.wake_all();
  needed_ = evaluations_ = 0;
  anchors_ = state.anchors;
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
  state.anchors = anchors_;
  state.time_s = until_s;
}

void ExplicitBody::add_forces(const NodeArrays& at_u, const NodeArrays& at_v) {
  for (const bool odd : {false, true})
    share((odd ? springs_.odd_slabs() : springs_.even_slabs()).size(), [&](std::size_t k) {
      for (const SpringBlocks::Slab& run : blocks_.needed(odd, k)) springs_.add_forces(run, at_u, at_v, f);
    });
  for (const bool odd : {false, true})
    share(hexahedra_.slabs(odd), [&](std::size_t k) { hexahedra_.add_forces(odd, k, at_u, at_v, f); });
  needed_ += blocks_.needed_share();
  evaluations_ += 1;
  dynamics_->contacts().each_force(
      anchors_.get(), [&](std::uint32_t i) { return Vec3(body().nodes[i] + at_u.at(i)); },
      [&](std::uint32_t i) { return at_v.at(i); }, [&](std::uint32_t i, const Vec3& force) { f.set(i, f.at(i) + force); });
}

void ExplicitBody::follow_contacts() {
  anchors_ = dynamics_->contacts().followed(
      anchors_.get(), [&](std::uint32_t i) { return Vec3(body().nodes[i] + u.at(i)); }, [&](std::uint32_t i) { return v.at(i); });
}

HexaForces::Growth ExplicitBody::growth() const {
  HexaForces::Growth growth = hexahedra_.growth(u);
  growth.stiffness = std::max(growth.stiffness / Spectrum::kSolidStiffer, springs_.stiffest(u));
  growth.damping = std::max(growth.damping / Spectrum::kThicker, 1.0);
  return growth;
}

void ExplicitBody::accelerate(NodeArrays& a) {
  on_parts(blocks_.with_forces(), [&](node_loops::Nodes nodes) {
    const Vec3& gravity = body().gravity_m_s2;
    node_loops::accelerate(nodes, inverse_mass_, f.x, static_cast<float>(gravity.x()), a.x);
    node_loops::accelerate(nodes, inverse_mass_, f.y, static_cast<float>(gravity.y()), a.y);
    node_loops::accelerate(nodes, body().planar ? nowhere_ : inverse_mass_, f.z, static_cast<float>(gravity.z()), a.z);
  });
  for (const node_loops::Nodes& run : blocks_.spilled())
    for (auto* axis : {&f.x, &f.y, &f.z})
      std::fill(axis->begin() + static_cast<std::ptrdiff_t>(run.begin), axis->begin() + static_cast<std::ptrdiff_t>(run.end),
                0.0F);
}

/// Returns sum of |F| + m |v| per_s over a block, F = m a; infinite if that is not a number.
double ExplicitBody::unbalanced_n(std::size_t block, const NodeArrays& a, double per_s) const {
  double sum = 0;
  for (std::size_t k = 0; k < NodeArrays::kBlock; ++k) {
    const auto i = static_cast<std::uint32_t>(NodeArrays::kBlock * block + k);
    if (!(inverse_mass_[i] > 0)) continue;
    double one = a.at(i).norm();
    if (per_s > 0) one += per_s * v.at(i).norm();
    sum += one / inverse_mass(i);
  }
  return std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
}

void ExplicitBody::let_rest(const NodeArrays& a, const std::vector<std::uint32_t>& busy, double over_s,
                            std::span<NodeArrays* const> zero) {
  unbalanced_.resize(blocks_.blocks());
  for (std::size_t b = 0; b < unbalanced_.size(); ++b) unbalanced_[b] = unbalanced_n(b, a, 1 / over_s);
  for (const std::uint32_t node : busy) unbalanced_[node / NodeArrays::kBlock] = std::numeric_limits<double>::infinity();
  blocks_.choose(unbalanced_, left_out_n_);
  for (std::size_t b = 0; b < blocks_.blocks(); ++b) {
    if (blocks_.moves(b)) continue;
    const auto begin = static_cast<std::ptrdiff_t>(NodeArrays::kBlock * b);
    const auto clear = [&](NodeArrays& y) {
      for (auto* axis : {&y.x, &y.y, &y.z}) std::fill_n(axis->begin() + begin, NodeArrays::kBlock, 0.0F);
    };
    clear(v);
    for (NodeArrays* y : zero) clear(*y);
  }
}

void ExplicitBody::wake(const NodeWeights& contact) {
  for (const auto& [node, weight] : contact) blocks_.wake(node / NodeArrays::kBlock);
  blocks_.renew();
}

void ExplicitBody::wake_disturbed(const NodeArrays& a, int evaluations) {
  if (blocks_.all_move()) return;
  unbalanced_.clear();
  for (const std::uint32_t b : blocks_.watched()) unbalanced_.push_back(unbalanced_n(b, a, 0));
  blocks_.look(unbalanced_, evaluations);
  blocks_.renew();
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
