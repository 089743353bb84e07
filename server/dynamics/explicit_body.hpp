// A body of springs or hexahedra in single precision for explicit integrators: the positions of its nodes and the forces on them.
//
//     a = M^-1 (F(u, v) + ...) + gravity for free nodes, 0 for held ones
//
// Displacements u [m] are relative to the rest shape (spring_blocks.hpp): one of 10 mm is accurate to 1 nm. A thread pool shares
// the elements, slab by slab, and the loops over nodes; the results have the same bits for any number of threads. Blocks of nodes
// of springs in equilibrium may rest (resting_blocks.hpp): their nodes keep their positions with v = a = 0, and their forces are
// not computed.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "server/body/hexa_forces.hpp"
#include "server/body/skin.hpp"
#include "server/dynamics/node_loops.hpp"
#include "server/dynamics/resting_blocks.hpp"
#include "server/dynamics/stepper.hpp"
#include "server/elements/spring_blocks.hpp"

namespace palpate {

class ExplicitBody {
 public:
  static constexpr std::size_t kWorthSharing = 60'000;  ///< springs, with gaps, at which threads pay off: an evaluation of 30 us
  static constexpr std::size_t kHexaWorthSharing = 2'000;

  /// Returns true if explicit steps support everything that the body is made of.
  static bool covers(const LumpedBody& body) { return SpringBlocks::covers(body) || HexaForces::covers(body); }
  /// `dynamics` must outlive it; covers() must hold for its body.
  explicit ExplicitBody(const Dynamics& dynamics);
  void use_threads(ThreadPool& pool);

  void take(const BodyState& state, const std::vector<ToolPort>& ports);
  /// Writes the body into `state`. Nodes that tools hold are at their tools; their velocity is the mean over the last kHeldOverS
  /// [s], as a single reading of a device may jump.
  void give(BodyState& state, const std::vector<ToolPort>& ports, const ToolMotion& tools, double until_s) const;

  /// Adds the forces of the elements, and of contacts, to f.
  void add_forces(const NodeArrays& at_u, const NodeArrays& at_v);
  /// Moves the anchors of friction to where they are at the end of a step.
  void follow_contacts();
  /// Computes `a` from f, and sets f to zero.
  void accelerate(NodeArrays& a);
  /// Returns the displacement of a node that is moved to `to`; within the plane if the body is planar.
  Vec3 displacement(std::uint32_t node, const Vec3& to) const;
  /// Returns true if the tool of this port holds a node that is not fixed.
  bool is_held(const ToolPort& port) const { return port.kind == ContactKind::attach && !body().fixed[port.node]; }
  /// Returns false if a node is far out, moved by more than an element in one step, or is not a number.
  bool is_sound(double h) const;

  const LumpedBody& body() const { return dynamics_->body(); }
  double spacing_m() const { return spacing_m_; }  ///< mean length of an element
  const SpringBlocks& springs() const { return springs_; }
  const HexaForces& hexahedra() const { return hexahedra_; }
  /// Returns the growth of the largest eigenvalues of K and D since the body was at rest; at least 1.
  HexaForces::Growth growth() const;
  double inverse_mass(std::uint32_t node) const { return static_cast<double>(inverse_mass_[node]); }

  static constexpr std::size_t kLeastBlocks = 150;  ///< minimum number that may rest: fewer cost less than the decision

  /// Sets the force that may be left out of balance [N]; 0: nothing rests.
  void set_quiescence_tolerance(double most_n) { left_out_n_ = most_n; }
  bool may_rest() const {
    return left_out_n_ > 0 && hexahedra_.size() == 0 && blocks_.blocks() >= kLeastBlocks && dynamics_->contacts().empty();
  }
  /// Lets blocks rest over the next `over_s` [s], except those of `busy` nodes. `a`: all accelerations, those of contacts
  /// included. For nodes that rest sets v and the arrays in `zero` to zero (`a` may be among them).
  void let_rest(const NodeArrays& a, const std::vector<std::uint32_t>& busy, double over_s, std::span<NodeArrays* const> zero);
  /// Wakes nodes that a contact pushes.
  void wake(const NodeWeights& contact);
  /// Wakes nodes that their neighbours pull out of balance, by `a`, and those within reach of them in a step of `evaluations`.
  void wake_disturbed(const NodeArrays& a, int evaluations);
  /// Returns the mean share of the springs that were evaluated since take().
  double needed_share() const { return evaluations_ > 0 ? needed_ / evaluations_ : 1; }

  /// Calls work(axis, nodes) for every axis of every part of the moving nodes, with the thread pool if there is one.
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
  /// Calls work(nodes) on these runs, cut at the boundaries of the parts.
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
  std::shared_ptr<const ContactAnchors> anchors_;
  std::vector<double> unbalanced_;  // per block [N]
  double left_out_n_ = 0, needed_ = 0, evaluations_ = 0;
  ThreadPool* pool_ = nullptr;
  double spacing_m_ = 0;
  std::vector<float> inverse_mass_;  // 0: held
  std::vector<float> nowhere_;       // zeros: the inverse masses along an axis without motion
};

}  // namespace palpate
