// Which blocks of a body of springs (spring_blocks.hpp) move, and which are left out because nothing happens there.
//
//     S_b = sum over the nodes of block b of |F_i| + m_i |v_i| / T        [N]
//
// is what holding the block where it is takes from the balance of the body over the next T. The blocks with the least S rest, as
// long as all of theirs together stay below half of what may be left out. Resting blocks that moving ones pull at are watched:
// when all S together have grown beyond what may be left out, those with the most of it move again, and as many rings of blocks
// around them as a step reaches nodes far. A tool feels what is left out through the body, so less.
//
// Forces on blocks that move or are watched are complete, and summed in the order of all blocks: the same bits.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/body/node_loops.hpp"
#include "server/body/spring_blocks.hpp"

namespace palpate {

class RestingBlocks {
 public:
  /// All move.
  explicit RestingBlocks(const SpringBlocks& springs);

  using Slab = SpringBlocks::Slab;
  std::size_t blocks() const { return state_.size(); }
  bool all_move() const { return resting_ == 0; }
  bool moves(std::size_t block) const { return state_[block] == kMoves; }
  bool rests(std::size_t block) const { return state_[block] != kMoves; }

  void wake_all();
  /// `unbalanced_n`: S_b; infinite where it must move. `most_n`: what may be left out.
  void choose(std::span<const double> unbalanced_n, double most_n);
  void wake(std::size_t block);
  /// Those that are watched.
  std::span<const std::uint32_t> watched() const { return watched_; }
  /// `unbalanced_n`: what S has become, parallel to watched(). Some of them may move from now on, and `rings` around them.
  void look(std::span<const double> unbalanced_n, int rings);
  /// What has changed since holds from here on.
  void renew();

  /// Of nodes.
  std::span<const node_loops::Nodes> moving() const { return moving_; }
  std::span<const node_loops::Nodes> with_forces() const { return with_forces_; }  ///< that move or are watched
  std::span<const node_loops::Nodes> spilled() const { return spilled_; }          ///< others that springs add forces to
  /// Blocks of a slab whose springs are needed, as runs.
  std::span<const Slab> needed(bool odd, std::size_t slab) const { return (odd ? odd_ : even_)[slab]; }
  /// Of all blocks, those whose springs are needed.
  double needed_share() const { return needed_share_; }

 private:
  enum State : std::uint8_t { kMoves, kWatched, kRests };
  void mark();
  /// visit(a, b) for any two blocks with a spring between them.
  template <typename Visit>
  void each_link(const Visit& visit) const {
    for (std::size_t b = 0; b < state_.size(); ++b)
      for (std::uint32_t k = first_[b]; k < first_[b + 1]; ++k) visit(b, reached_[k]);
  }

  const SpringBlocks* springs_;
  std::vector<std::uint32_t> first_, reached_;  // blocks that the springs of a block reach, itself aside
  std::vector<std::uint8_t> state_, is_needed_, gets_forces_;
  std::vector<double> unbalanced_n_;  // of those that rest
  double most_n_ = 0;
  std::vector<std::uint32_t> watched_;
  std::size_t resting_ = 0;
  bool changed_ = true;
  double needed_share_ = 1;
  std::vector<node_loops::Nodes> moving_, with_forces_, spilled_;
  std::vector<std::vector<Slab>> even_, odd_;  // parallel to those of the springs
};

}  // namespace palpate
