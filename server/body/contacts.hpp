// Contacts of a body with rigid parts, of its members with each other, and of a member with itself: springs, dampers and Coulomb
// friction (contact_spring.hpp) at the nodes of surfaces. Members are in body_contacts.hpp. With a part, node i at x has
//
//     d = -phi(x), g = grad phi (distance_grid.hpp), v its velocity, its way from the anchor x - a,   k = ratio K_ii,   c = t k
//
// K_ii is the node's own stiffness at rest, the mean of its diagonal, for slow motions; t the least damping time of the body's
// materials; d_0 kOnsetEdges times the mean edge. So a contact is stiffer than the body beneath it, and as damped.
//
// Shapes: x, v, g, a 3; all in frame W. Units: d, d_0 m; k N/m; c N s/m; t s.
// What can go wrong: a node that is beyond the middle of a thin part is pushed out at its other side; edges and corners of a part
// pass between nodes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/body/body_contacts.hpp"
#include "server/body/contact_spring.hpp"
#include "server/elements/body_state.hpp"
#include "server/elements/column_lanes.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// Anchors of the nodes in contact, by surface (parts, and then members), then by node.
struct ContactAnchors {
  struct Anchor {
    std::uint32_t surface = 0, node = 0;
    Vec3 at;  ///< in a member: of its rest shape [m]
  };
  std::vector<Anchor> all;

  std::optional<Vec3> at(std::uint32_t surface, std::uint32_t node) const;
};

class Contacts {
 public:
  static constexpr double kOnsetEdges = 0.1;

  /// A contact, linearised: the force on node a is w_a f, and f changes by -K y - D y', y = sum_a w_a x_a.
  struct Block {
    NodeWeights nodes;        ///< (a, w_a): one of weight 1, and -1 in all on the cell that it touches
    Mat3 stiffness, damping;  ///< K [N/m], D [N s/m]
  };

  /// `body` must outlive it. It has no stiffness until set_stiffness().
  explicit Contacts(const LumpedBody& body);
  bool empty() const { return parts_.empty() && bodies_.empty(); }
  /// Sets K_ii of all nodes [N/m].
  void set_stiffness(const std::vector<double>& own_n_m);
  /// Upper bounds of the eigenvalues that contacts add to M^-1 K [1/s^2] and M^-1 D [1/s].
  double most_w2() const;
  double most_g() const { return damping_s_ * most_w2(); }

  /// Calls visit(node, force) for every node that a contact pushes, once for each; position(node) and velocity(node) are Vec3.
  template <class Position, class Velocity, class Visit>
  void each_force(const ContactAnchors* anchors, const Position& position, const Velocity& velocity, const Visit& visit) const {
    each_near(position, [&](std::uint32_t node, std::uint32_t part, const Vec3& x) {
      if (const auto touch = touch_part(anchors, node, part, x, velocity(node))) visit(node, touch->force);
    });
    if (bodies_.empty()) return;
    for (const BodyContacts::Meeting& m : bodies_.at(position)) {
      const auto touch = touch_body(anchors, m, velocity);
      if (!touch) continue;
      visit(m.node, touch->force);
      for (std::size_t a = 0; a < m.corners.size(); ++a) visit(m.corners[a], Vec3(-m.weights[a] * touch->force));
    }
  }
  /// Returns the anchors at the end of a step; null if no node touches.
  template <class Position, class Velocity>
  std::shared_ptr<const ContactAnchors> followed(const ContactAnchors* anchors, const Position& position,
                                                 const Velocity& velocity) const {
    ContactAnchors next;
    each_near(position, [&](std::uint32_t node, std::uint32_t part, const Vec3& x) {
      if (const auto touch = touch_part(anchors, node, part, x, velocity(node)))
        next.all.push_back({part, node, x - touch->kept});
    });
    if (!bodies_.empty()) follow_bodies(anchors, position, velocity, next);
    if (next.all.empty()) return nullptr;
    return std::make_shared<const ContactAnchors>(std::move(next));
  }
  void follow(BodyState& state) const;

  void add_forces(const BodyState& state, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  /// One block for each node and surface in contact.
  std::vector<Block> tangents(const BodyState& state) const;
  /// Energy of the springs [J].
  double energy(const BodyState& state) const;

 private:
  std::optional<ContactTouch> touch_part(const ContactAnchors* anchors, std::uint32_t node, std::uint32_t part, const Vec3& x,
                                         const Vec3& v) const;
  std::optional<ContactTouch> touch_body(const ContactAnchors* anchors, const BodyContacts::Meeting& meeting,
                                         const BodyContacts::OfNode& velocity) const;
  void follow_bodies(const ContactAnchors* anchors, const BodyContacts::OfNode& position, const BodyContacts::OfNode& velocity,
                     ContactAnchors& next) const;
  template <class Visit>
  void each_touch(const BodyState& state, const Visit& visit) const;
  template <class Position, class Visit>
  void each_near(const Position& position, const Visit& visit) const {
    for (std::uint32_t part = 0; part < parts_.size(); ++part)
      for (const std::uint32_t node : nodes_) {
        const Vec3 x = position(node);
        if (parts_[part]->box.contains(x)) visit(node, part, x);
      }
  }

  std::vector<std::shared_ptr<const RigidPart>> parts_;
  BodyContacts bodies_;
  const LumpedBody* body_;
  std::vector<std::uint32_t> nodes_;  // that may touch a part: those of the surface that are not fixed
  std::vector<double> own_n_m_;       // K_ii of all nodes
  double damping_s_ = 0, onset_m_ = 0;
};

}  // namespace palpate
