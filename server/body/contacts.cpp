#include "server/body/contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/body/spectrum.hpp"

namespace palpate {

std::optional<Vec3> ContactAnchors::at(std::uint32_t surface, std::uint32_t node) const {
  const auto found = std::lower_bound(all.begin(), all.end(), std::pair(surface, node),
                                      [](const Anchor& a, const auto& key) { return std::pair(a.surface, a.node) < key; });
  if (found == all.end() || found->surface != surface || found->node != node) return std::nullopt;
  return found->at;
}

Contacts::Contacts(const LumpedBody& body) : parts_(body.parts), bodies_(body), body_(&body) {
  if (empty()) return;
  for (const Triangle& t : body.triangles)
    for (const std::uint32_t i : t)
      if (body.is_node(i) && !body.fixed[i]) nodes_.push_back(i);
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  own_n_m_.assign(body.nodes.size(), 0);
  damping_s_ = damping_times(body).first;
  onset_m_ = kOnsetEdges * mean_edge_m(body);
}

void Contacts::set_stiffness(const std::vector<double>& own_n_m) {
  own_n_m_ = own_n_m;
  bodies_.set_stiffness(own_n_m);
}

double Contacts::most_w2() const {
  std::array<double, 2> ratio{};  // of the stiffest two: a node in a corner touches both
  double most = 0;
  for (const auto& part : parts_) {
    ratio[1] = std::max(ratio[1], std::min(ratio[0], part->stiffness_ratio));
    ratio[0] = std::max(ratio[0], part->stiffness_ratio);
  }
  for (const std::uint32_t i : nodes_) most = std::max(most, own_n_m_[i] / body_->masses_kg[i]);
  return (ratio[0] + ratio[1]) * most + bodies_.most_w2();
}

std::optional<ContactTouch> Contacts::touch_part(const ContactAnchors* anchors, std::uint32_t node, std::uint32_t part,
                                                 const Vec3& x, const Vec3& v) const {
  const RigidPart& rigid = *parts_[part];
  const auto at = rigid.distance.at(x);
  if (!at || !(at->distance_m < 0)) return std::nullopt;
  const double stiffness = rigid.stiffness_ratio * own_n_m_[node];
  std::optional<Vec3> offset = anchors ? anchors->at(part, node) : std::nullopt;
  if (offset) offset = x - *offset;
  return touch_of({stiffness, damping_s_ * stiffness, rigid.friction, onset_m_}, -at->distance_m, at->gradient, v, offset);
}

std::optional<ContactTouch> Contacts::touch_body(const ContactAnchors* anchors, const BodyContacts::Meeting& meeting,
                                                 const BodyContacts::OfNode& velocity) const {
  Vec3 v = velocity(meeting.node);
  for (std::size_t a = 0; a < meeting.corners.size(); ++a) v -= meeting.weights[a] * velocity(meeting.corners[a]);
  const double stiffness = bodies_.stiffness_n_m(meeting);
  const auto surface = static_cast<std::uint32_t>(parts_.size()) + meeting.member;
  std::optional<Vec3> offset = anchors ? anchors->at(surface, meeting.node) : std::nullopt;
  if (offset) offset = meeting.deformation * (meeting.rest - *offset);
  return touch_of({stiffness, damping_s_ * stiffness, bodies_.friction(meeting), onset_m_}, meeting.depth_m, meeting.gradient, v,
                  offset);
}

void Contacts::follow_bodies(const ContactAnchors* anchors, const BodyContacts::OfNode& position,
                             const BodyContacts::OfNode& velocity, ContactAnchors& next) const {
  for (const BodyContacts::Meeting& m : bodies_.at(position))
    if (const auto touch = touch_body(anchors, m, velocity))
      next.all.push_back(
          {static_cast<std::uint32_t>(parts_.size()) + m.member, m.node, m.rest - m.deformation.inverse() * touch->kept});
}

void Contacts::follow(BodyState& state) const {
  if (empty()) return;
  state.anchors = followed(
      state.anchors.get(), [&](std::uint32_t i) { return Vec3(at_node(state.x, i)); },
      [&](std::uint32_t i) { return Vec3(at_node(state.v, i)); });
}

void Contacts::add_forces(const BodyState& state, Vector& f) const {
  each_force(
      state.anchors.get(), [&](std::uint32_t i) { return Vec3(at_node(state.x, i)); },
      [&](std::uint32_t i) { return Vec3(at_node(state.v, i)); },
      [&](std::uint32_t i, const Vec3& force) { at_node(f, i) += force; });
}

Vec3 Contacts::force_on(const BodyState& state, std::uint32_t node) const {
  Vec3 sum = Vec3::Zero();
  each_force(
      state.anchors.get(), [&](std::uint32_t i) { return Vec3(at_node(state.x, i)); },
      [&](std::uint32_t i) { return Vec3(at_node(state.v, i)); },
      [&](std::uint32_t i, const Vec3& force) {
        if (i == node) sum += force;
      });
  return sum;
}

/// Calls visit(touch, node, meeting) for each contact; the meeting is null for one with a part.
template <class Visit>
void Contacts::each_touch(const BodyState& state, const Visit& visit) const {
  const auto position = [&](std::uint32_t i) { return Vec3(at_node(state.x, i)); };
  const auto velocity = [&](std::uint32_t i) { return Vec3(at_node(state.v, i)); };
  each_near(position, [&](std::uint32_t node, std::uint32_t part, const Vec3& x) {
    if (const auto touch = touch_part(state.anchors.get(), node, part, x, velocity(node))) visit(*touch, node, nullptr);
  });
  if (bodies_.empty()) return;
  for (const BodyContacts::Meeting& m : bodies_.at(position))
    if (const auto touch = touch_body(state.anchors.get(), m, velocity)) visit(*touch, m.node, &m);
}

std::vector<Contacts::Block> Contacts::tangents(const BodyState& state) const {
  std::vector<Block> blocks;
  each_touch(state, [&](const ContactTouch& touch, std::uint32_t node, const BodyContacts::Meeting* meeting) {
    Block& block = blocks.emplace_back(Block{{{node, 1.0}}, touch.stiffness, touch.damping});
    for (std::size_t a = 0; meeting && a < meeting->corners.size(); ++a)
      if (meeting->weights[a] != 0) block.nodes.emplace_back(meeting->corners[a], -meeting->weights[a]);
  });
  return blocks;
}

double Contacts::energy(const BodyState& state) const {
  double energy_j = 0;
  each_touch(state, [&](const ContactTouch& touch, std::uint32_t, const BodyContacts::Meeting*) { energy_j += touch.energy_j; });
  return energy_j;
}

}  // namespace palpate
