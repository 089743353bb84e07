// Contacts of a body with rigid parts: springs, dampers and Coulomb friction at the nodes of its surface.
//
// Node i is at depth d = -phi(x) in a part (distance_grid.hpp), g = grad phi, n = g / |g|, P = 1 - n n^T:
//
//     normal        N g,   N = max(0, k d - c g . v min(1, d / d_0))
//     friction      T = -H cut to |T| <= mu N |g|,   H = k P (x - a) + c P v
//     anchor a      x where contact begins; after each step a moves so that |k P (x - a)| <= mu N |g|
//     k = ratio K_ii,   c = t k,   d_0 = kOnsetEdges times the mean edge
//
// K_ii is the node's own stiffness at rest, the mean of its diagonal, for slow motions; t the least damping time of the body's
// materials; d_0 lets the damper begin without a step. So a contact is stiffer than the body beneath it, and as damped.
// K = k g g^T + k P where it sticks, and with (mu N |g| / |H|) k (P - s s^T), s = H / |H|, instead of k P where it slips; D
// likewise, with c min(1, d / d_0) g g^T and c. The part of the tangent of a slip that is not symmetric is left out.
//
// Shapes: x, v, g, n, a, T 3; all in frame W. Units: d, d_0 m; k N/m; c N s/m; t s.
// What can go wrong: a node that is beyond the middle of a thin part is pushed out at its other side; edges and corners of a part
// pass between nodes.
// Source: penalty contact with a return map for friction, Wriggers, Computational Contact Mechanics (2006), 5.2 and 6.3.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/elements/body_state.hpp"
#include "server/elements/column_lanes.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// Anchors of the nodes of a body's surface, part after part; none where a node does not touch.
struct PartAnchors {
  std::vector<std::optional<Vec3>> at;  ///< [m]
};

class PartContacts {
 public:
  static constexpr double kOnsetEdges = 0.1;

  /// A node in contact, linearised.
  struct Block {
    std::uint32_t node = 0;
    Mat3 stiffness, damping;  ///< K [N/m], D [N s/m]
  };

  /// `body` must outlive it. It has no stiffness until set_stiffness().
  explicit PartContacts(const LumpedBody& body);
  bool empty() const { return parts_.empty(); }
  /// Nodes that may touch: those of the surface that are not fixed.
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  /// Sets K_ii of nodes() [N/m].
  void set_stiffness(const std::vector<double>& own_n_m);
  /// Upper bounds of the eigenvalues that contacts add to M^-1 K [1/s^2] and M^-1 D [1/s].
  double most_w2() const;
  double most_g() const { return damping_s_ * most_w2(); }

  /// Calls visit(node, force) for every node in contact; position(node) and velocity(node) are Vec3.
  template <class Position, class Velocity, class Visit>
  void each_force(const PartAnchors* anchors, const Position& position, const Velocity& velocity, const Visit& visit) const {
    each_near(position, [&](std::size_t k, std::size_t part, const Vec3& x) {
      if (const auto touch = touch_of(anchors, k, part, x, velocity(nodes_[k]))) visit(nodes_[k], touch->force);
    });
  }
  /// Returns the anchors at the end of a step; null if no node touches.
  template <class Position, class Velocity>
  std::shared_ptr<const PartAnchors> followed(const PartAnchors* anchors, const Position& position,
                                              const Velocity& velocity) const {
    std::shared_ptr<PartAnchors> next;
    each_near(position, [&](std::size_t k, std::size_t part, const Vec3& x) {
      const auto touch = touch_of(anchors, k, part, x, velocity(nodes_[k]));
      if (!touch) return;
      if (!next)
        next = std::make_shared<PartAnchors>(PartAnchors{std::vector<std::optional<Vec3>>(nodes_.size() * parts_.size())});
      next->at[part * nodes_.size() + k] = touch->anchor;
    });
    return next;
  }
  void follow(BodyState& state) const;

  void add_forces(const BodyState& state, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  /// One block for each node and part in contact.
  std::vector<Block> tangents(const BodyState& state) const;
  /// Energy of the springs [J].
  double energy(const BodyState& state) const;

 private:
  struct Touch {
    Vec3 force, anchor;
    Mat3 stiffness, damping;
    double energy_j = 0;
  };
  std::optional<Touch> touch_of(const PartAnchors* anchors, std::size_t k, std::size_t part, const Vec3& x, const Vec3& v) const;
  template <class Position, class Visit>
  void each_near(const Position& position, const Visit& visit) const {
    for (std::size_t part = 0; part < parts_.size(); ++part)
      for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Vec3 x = position(nodes_[k]);
        if (parts_[part]->box.contains(x)) visit(k, part, x);
      }
  }

  std::vector<std::shared_ptr<const RigidPart>> parts_;
  const LumpedBody* body_;
  std::vector<std::uint32_t> nodes_;
  std::vector<double> own_n_m_;  // K_ii
  double damping_s_ = 0, onset_m_ = 0;
};

}  // namespace palpate
