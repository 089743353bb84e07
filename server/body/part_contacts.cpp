#include "server/body/part_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/body/spectrum.hpp"

namespace palpate {

PartContacts::PartContacts(const LumpedBody& body) : parts_(body.parts), body_(&body) {
  if (parts_.empty()) return;
  for (const Triangle& t : body.triangles)
    for (const std::uint32_t i : t)
      if (body.is_node(i) && !body.fixed[i]) nodes_.push_back(i);
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  own_n_m_.assign(nodes_.size(), 0);
  damping_s_ = damping_times(body).first;
  onset_m_ = kOnsetEdges * mean_edge_m(body);
}

void PartContacts::set_stiffness(const std::vector<double>& own_n_m) { own_n_m_ = own_n_m; }

double PartContacts::most_w2() const {
  std::array<double, 2> ratio{};  // of the stiffest two: a node in a corner touches both
  double most = 0;
  for (const auto& part : parts_) {
    ratio[1] = std::max(ratio[1], std::min(ratio[0], part->stiffness_ratio));
    ratio[0] = std::max(ratio[0], part->stiffness_ratio);
  }
  for (std::size_t k = 0; k < nodes_.size(); ++k) most = std::max(most, own_n_m_[k] / body_->masses_kg[nodes_[k]]);
  return (ratio[0] + ratio[1]) * most;
}

std::optional<PartContacts::Touch> PartContacts::touch_of(const PartAnchors* anchors, std::size_t k, std::size_t part,
                                                          const Vec3& x, const Vec3& v) const {
  const RigidPart& rigid = *parts_[part];
  const auto at = rigid.distance.at(x);
  if (!at || !(at->distance_m < 0)) return std::nullopt;
  const Vec3& g = at->gradient;
  const double length = g.norm();
  constexpr double kNoDirection = 1e-6;  // in the middle of a part
  if (!(length > kNoDirection)) return std::nullopt;
  const double depth = -at->distance_m, stiffness = rigid.stiffness_ratio * own_n_m_[k];
  const double damping = damping_s_ * stiffness, onset = std::min(1.0, depth / onset_m_);
  const double n = std::max(0.0, stiffness * depth - damping * onset * g.dot(v)), most = rigid.friction * n * length;
  const Mat3 across = Mat3::Identity() - g * g.transpose() / (length * length);
  const std::optional<Vec3> anchor = anchors ? anchors->at[part * nodes_.size() + k] : std::nullopt;

  Touch touch;
  touch.force = n * g;
  touch.stiffness = stiffness * g * g.transpose();
  touch.damping = onset * damping * g * g.transpose();
  touch.energy_j = 0.5 * stiffness * depth * depth;
  touch.anchor = x;
  if (!anchor) return touch;
  const Vec3 stretch = across * (x - *anchor), hold = stiffness * stretch + damping * (across * v);
  const double held_n = hold.norm(), stretched_n = stiffness * stretch.norm();
  const double kept = stretched_n > most ? most / stretched_n : 1;
  touch.anchor -= kept * stretch;
  touch.energy_j += 0.5 * kept * kept * stiffness * stretch.squaredNorm();
  if (held_n <= most) {
    touch.force -= hold;
    touch.stiffness += stiffness * across;
    touch.damping += damping * across;
    return touch;
  }
  const Vec3 along = hold / held_n;
  const Mat3 turning = most / held_n * (across - along * along.transpose());
  touch.force -= most * along;
  touch.stiffness += stiffness * turning;
  touch.damping += damping * turning;
  return touch;
}

void PartContacts::follow(BodyState& state) const {
  if (empty()) return;
  state.anchors = followed(
      state.anchors.get(), [&](std::uint32_t i) { return Vec3(at_node(state.x, i)); },
      [&](std::uint32_t i) { return Vec3(at_node(state.v, i)); });
}

void PartContacts::add_forces(const BodyState& state, Vector& f) const {
  each_force(
      state.anchors.get(), [&](std::uint32_t i) { return Vec3(at_node(state.x, i)); },
      [&](std::uint32_t i) { return Vec3(at_node(state.v, i)); },
      [&](std::uint32_t i, const Vec3& force) { at_node(f, i) += force; });
}

Vec3 PartContacts::force_on(const BodyState& state, std::uint32_t node) const {
  Vec3 sum = Vec3::Zero();
  each_force(
      state.anchors.get(), [&](std::uint32_t i) { return Vec3(at_node(state.x, i)); },
      [&](std::uint32_t i) { return Vec3(at_node(state.v, i)); },
      [&](std::uint32_t i, const Vec3& force) {
        if (i == node) sum += force;
      });
  return sum;
}

std::vector<PartContacts::Block> PartContacts::tangents(const BodyState& state) const {
  std::vector<Block> blocks;
  each_near([&](std::uint32_t i) { return Vec3(at_node(state.x, i)); },
            [&](std::size_t k, std::size_t part, const Vec3& x) {
              if (const auto touch = touch_of(state.anchors.get(), k, part, x, at_node(state.v, nodes_[k])))
                blocks.push_back({nodes_[k], touch->stiffness, touch->damping});
            });
  return blocks;
}

double PartContacts::energy(const BodyState& state) const {
  double energy_j = 0;
  each_near([&](std::uint32_t i) { return Vec3(at_node(state.x, i)); },
            [&](std::size_t k, std::size_t part, const Vec3& x) {
              if (const auto touch = touch_of(state.anchors.get(), k, part, x, at_node(state.v, nodes_[k])))
                energy_j += touch->energy_j;
            });
  return energy_j;
}

}  // namespace palpate
