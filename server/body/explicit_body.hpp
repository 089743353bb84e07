// A body of springs or of hexahedra in single precision, as explicit integrators move it: where its nodes are, and the forces on
// them.
//
//     a = M^-1 (F(u, v) + ...) + gravity for nodes that move, 0 for those that are held
//
// Displacements u [m] from the shape at rest (spring_blocks.hpp): one of 10 mm is right to 1 nm. A thread pool shares the
// elements, slab by slab, and the loops over nodes: same bits whatever its size. Blocks of nodes of springs where nothing happens
// may rest (resting_blocks.hpp): they are where they are, v = a = 0, and what acts on them is not asked.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "server/body/hexa_forces.hpp"
#include "server/body/node_loops.hpp"
#include "server/body/resting_blocks.hpp"
#include "server/body/skin.hpp"
#include "server/body/spring_blocks.hpp"
#include "server/body/stepper.hpp"

namespace palpate {

class ExplicitBody {
 public:
  static constexpr std::size_t kWorthSharing = 60'000;  ///< springs, with gaps: an evaluation of 30 us
  static constexpr std::size_t kHexaWorthSharing = 2'000;

  /// Whether explicit steps know all that the body is made of.
  static bool covers(const LumpedBody& body) { return SpringBlocks::covers(body) || HexaForces::covers(body); }
  /// `dynamics` must outlive it. covers() its body.
  explicit ExplicitBody(const Dynamics& dynamics);
  void use_threads(ThreadPool& pool);

  void take(const BodyState& state, const std::vector<ToolPort>& ports);
  /// Nodes that tools hold are where those are; their velocity is that of the way over the last kHeldOverS: one reading of a
  /// device may jump.
  void give(BodyState& state, const std::vector<ToolPort>& ports, const ToolMotion& tools, double until_s) const;

  /// f += forces of the elements.
  void add_forces(const NodeArrays& at_u, const NodeArrays& at_v);
  /// Of f, which is zero again.
  void accelerate(NodeArrays& a);
  /// Displacement of a node that is taken there; in its plane where the body is planar.
  Vec3 displacement(std::uint32_t node, const Vec3& to) const;
  /// Whether the tool of this port holds a node that would move.
  bool is_held(const ToolPort& port) const { return port.kind == ContactKind::attach && !body().fixed[port.node]; }
  /// No node is far out or went further than an element in one step; not a number fails both.
  bool is_sound(double h) const;

  const LumpedBody& body() const { return dynamics_->body(); }
  double spacing_m() const { return spacing_m_; }  ///< mean length of an element
  const SpringBlocks& springs() const { return springs_; }
  const HexaForces& hexahedra() const { return hexahedra_; }
  /// How much the largest eigenvalues of K and D may have grown since the body was at rest; at least 1.
  HexaForces::Growth growth() const;
  double inverse_mass(std::uint32_t node) const { return static_cast<double>(inverse_mass_[node]); }

  static constexpr std::size_t kLeastBlocks = 150;  ///< that may rest: fewer cost less than it takes to tell them apart

  /// What may be left out of balance [N]; 0: nothing rests.
  void leave_out(double most_n) { left_out_n_ = most_n; }
  bool may_rest() const { return left_out_n_ > 0 && hexahedra_.size() == 0 && blocks_.blocks() >= kLeastBlocks; }
  /// Lets blocks rest over the next `over_s`, `a` being all accelerations, those of contacts included; not those of `busy` nodes.
  /// Of nodes that rest v is zero, and what is given, `a` among them.
  void let_rest(const NodeArrays& a, const std::vector<std::uint32_t>& busy, double over_s, std::span<NodeArrays* const> zero);
  /// Nodes that a contact pushes do not rest.
  void wake(const Skin::Weights& contact);
  /// Nor do those that others pull at, by `a`, and those that a step, of so many evaluations of the forces, reaches from there.
  void wake_disturbed(const NodeArrays& a, int evaluations);
  /// Of the springs, those that were needed on average since take().
  double needed_share() const { return evaluations_ > 0 ? needed_ / evaluations_ : 1; }

  /// work(axis, nodes) on every axis of every part of the nodes that move, with the thread pool where there is one.
  template <typename Work>
  void on_each_axis(const Work& work) const {
    on_parts(blocks_.moving(), [&](node_loops::Nodes nodes) {
      for (auto axis : {&NodeArrays::x, &NodeArrays::y, &NodeArrays::z}) work(axis, nodes);
    });
  }

  NodeArrays u, v, f;

 private:
  static constexpr double kHeldOverS = 0.006;

  std::size_t node_parts() const { return pool_ ? pool_->size() : 1; }
  node_loops::Nodes nodes_of(std::size_t part) const;
  double unbalanced_n(std::size_t block, const NodeArrays& a, double per_s) const;
  /// work(nodes) on these runs, cut where the parts are.
  template <typename Work>
  void on_parts(std::span<const node_loops::Nodes> runs, const Work& work) const {
    share(node_parts(), [&](std::size_t part) {
      const node_loops::Nodes mine = nodes_of(part);
      for (const node_loops::Nodes& run : runs) {
        const node_loops::Nodes both{std::max(run.begin, mine.begin), std::min(run.end, mine.end)};
        if (both.begin < both.end) work(both);
      }
    });
  }
  template <typename Work>
  void share(std::size_t parts, const Work& work) const {
    if (pool_)
      pool_->run(parts, std::ref(work));
    else
      for (std::size_t part = 0; part < parts; ++part) work(part);
  }

  const Dynamics* dynamics_;
  SpringBlocks springs_;
  HexaForces hexahedra_;
  RestingBlocks blocks_;
  std::vector<double> unbalanced_;  // of blocks [N]
  double left_out_n_ = 0, needed_ = 0, evaluations_ = 0;
  ThreadPool* pool_ = nullptr;
  double spacing_m_ = 0;
  std::vector<float> inverse_mass_;  // 0: held
  std::vector<float> nowhere_;       // zeros: the same along an axis in which nothing moves
};

}  // namespace palpate
