// Selects the blocks of a body of springs (spring_blocks.hpp) that move; blocks in equilibrium are not computed.
//
//     S_b = sum over the nodes of block b of |F_i| + m_i |v_i| / T        [N]
//
// is the force that is neglected over the next T if block b is held where it is. The blocks with the least S rest, as long as
// their sum stays below half of the allowance. Resting blocks next to moving ones are watched: when the sum of all S exceeds the
// allowance, the watched blocks with the largest S move again, with as many rings of blocks around them as a step reaches. A tool
// feels neglected forces through the body, so it feels less than their sum.
//
// Forces on blocks that move or are watched are complete, and summed in the same order as for all blocks: the bits are the same.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/node_loops.hpp"
#include "server/elements/spring_blocks.hpp"

namespace palpate {

class RestingBlocks {
 public:
  /// All blocks move at first.
  explicit RestingBlocks(const SpringBlocks& springs);

  using Slab = SpringBlocks::Slab;
  std::size_t blocks() const { return state_.size(); }
  bool all_move() const { return resting_ == 0; }
  bool moves(std::size_t block) const { return state_[block] == kMoves; }
  bool rests(std::size_t block) const { return state_[block] != kMoves; }

  void wake_all();
  /// Selects the resting blocks. `unbalanced_n`: S_b; infinite for a block that must move. `most_n`: the allowance [N].
  void choose(std::span<const double> unbalanced_n, double most_n);
  void wake(std::size_t block);
  /// Returns the blocks that are watched.
  std::span<const std::uint32_t> watched() const { return watched_; }
  /// Checks the present S of the watched blocks, `unbalanced_n`, parallel to watched(). Some of them may be woken, with `rings`
  /// around them.
  void look(std::span<const double> unbalanced_n, int rings);
  /// Applies the changes since the last call.
  void renew();

  /// Runs of nodes: those that move, those that move or are watched, and others to which springs add forces.
  std::span<const node_loops::Nodes> moving() const { return moving_; }
  std::span<const node_loops::Nodes> with_forces() const { return with_forces_; }  ///< move or are watched
  std::span<const node_loops::Nodes> spilled() const { return spilled_; }          ///< others that springs add forces to
  /// Returns the blocks of a slab whose springs are needed, as runs.
  std::span<const Slab> needed(bool odd, std::size_t slab) const { return (odd ? odd_ : even_)[slab]; }
  /// Returns the share of blocks whose springs are needed.
  double needed_share() const { return needed_share_; }

 private:
  enum State : std::uint8_t { kMoves, kWatched, kRests };
  void mark();
  /// Calls visit(a, b) for any two blocks joined by a spring.
  template <typename Visit>
  void each_link(const Visit& visit) const {
    for (std::size_t b = 0; b < state_.size(); ++b)
      for (std::uint32_t k = first_[b]; k < first_[b + 1]; ++k) visit(b, reached_[k]);
  }

  const SpringBlocks* springs_;
  std::vector<std::uint32_t> first_, reached_;  // for each block, the others that its springs reach
  std::vector<std::uint8_t> state_, is_needed_, gets_forces_;
  std::vector<double> unbalanced_n_;  // of those that rest [N]
  double most_n_ = 0;
  std::vector<std::uint32_t> watched_;
  std::size_t resting_ = 0;
  bool changed_ = true;
  double needed_share_ = 1;
  std::vector<node_loops::Nodes> moving_, with_forces_, spilled_;
  std::vector<std::vector<Slab>> even_, odd_;  // parallel to those of the springs
};

}  // namespace palpate
