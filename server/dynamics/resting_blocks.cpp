#include "server/dynamics/resting_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

constexpr double kWorthSharing = 0.85;  // share of all blocks: if more are needed, all move
constexpr double kBegin = 0.5;          // share of the allowance that is used when blocks are chosen or woken

/// Returns the runs of blocks begin ... end - 1 for which wanted(block).
template <typename Wanted>
std::vector<SpringBlocks::Slab> runs(std::size_t begin, std::size_t end, const Wanted& wanted) {
  std::vector<SpringBlocks::Slab> found;
  for (std::size_t b = begin; b < end; ++b) {
    if (!wanted(b)) continue;
    if (found.empty() || found.back().end != b) found.push_back({b, b});
    found.back().end = b + 1;
  }
  return found;
}

}  // namespace

RestingBlocks::RestingBlocks(const SpringBlocks& springs) : springs_(&springs) {
  constexpr std::size_t kBlock = NodeArrays::kBlock;
  const SpringTables& tables = springs.tables();
  const std::size_t count = tables.first.size() - 1;
  first_.push_back(0);
  for (std::size_t b = 0; b < count; ++b) {
    std::vector<std::uint32_t> reached;
    for (std::uint32_t g = tables.first[b]; g < tables.first[b + 1]; ++g)
      for (std::size_t lane = 0; lane < kBlock; ++lane) {
        const SpringCoefficients& c = tables.coefficients[tables.groups[g].coefficients];
        if (c.stiffness_n_m[lane] == 0 && c.damping_n_s_m[lane] == 0) continue;
        const std::size_t other = (b * kBlock + lane + tables.groups[g].to) / kBlock;
        if (other != b) reached.push_back(static_cast<std::uint32_t>(other));
      }
    std::sort(reached.begin(), reached.end());
    reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
    reached_.insert(reached_.end(), reached.begin(), reached.end());
    first_.push_back(static_cast<std::uint32_t>(reached_.size()));
  }
  state_.resize(count);
  is_needed_.resize(count);
  gets_forces_.resize(count);
  unbalanced_n_.resize(count);
  wake_all();
}

void RestingBlocks::wake_all() {
  if (resting_ == 0 && !changed_) return;
  std::fill(state_.begin(), state_.end(), kMoves);
  resting_ = 0;
  changed_ = true;
  renew();
}

void RestingBlocks::choose(std::span<const double> unbalanced_n, double most_n) {
  wake_all();
  std::vector<std::uint32_t> order(state_.size());
  std::iota(order.begin(), order.end(), 0U);
  sort_stably(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return unbalanced_n[a] < unbalanced_n[b]; });
  most_n_ = most_n;
  std::copy(unbalanced_n.begin(), unbalanced_n.end(), unbalanced_n_.begin());
  double left_out_n = 0;
  for (const std::uint32_t b : order) {
    left_out_n += unbalanced_n[b];
    if (!(left_out_n <= kBegin * most_n)) break;
    state_[b] = kRests;
    ++resting_;
  }
  changed_ = true;
  renew();
  if (needed_share_ > kWorthSharing) wake_all();
}

void RestingBlocks::wake(std::size_t block) {
  if (moves(block)) return;
  state_[block] = kMoves;
  --resting_;
  changed_ = true;
}

void RestingBlocks::look(std::span<const double> unbalanced_n, int rings) {
  for (std::size_t k = 0; k < watched_.size(); ++k) unbalanced_n_[watched_[k]] = unbalanced_n[k];
  double left_out_n = 0;
  for (std::size_t b = 0; b < state_.size(); ++b)
    if (rests(b)) left_out_n += unbalanced_n_[b];
  if (left_out_n <= most_n_) return;
  std::vector<std::uint32_t> order = watched_;
  sort_stably(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return unbalanced_n_[a] > unbalanced_n_[b]; });
  std::vector<std::uint8_t> woken(state_.size(), 0);
  for (const std::uint32_t b : order) {
    if (left_out_n <= kBegin * most_n_) break;
    left_out_n -= unbalanced_n_[b];
    woken[b] = 1;
  }
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<std::uint8_t> inside = woken;
    each_link([&](std::size_t a, std::size_t b) {
      if (inside[a]) woken[b] = 1;
      if (inside[b]) woken[a] = 1;
    });
  }
  for (std::size_t b = 0; b < woken.size(); ++b)
    if (woken[b]) wake(b);
}

void RestingBlocks::mark() {
  for (std::uint8_t& state : state_)
    if (state == kWatched) state = kRests;
  each_link([&](std::size_t a, std::size_t b) {
    if (state_[a] == kRests && state_[b] == kMoves) state_[a] = kWatched;
    if (state_[b] == kRests && state_[a] == kMoves) state_[b] = kWatched;
  });
  for (std::size_t b = 0; b < state_.size(); ++b) is_needed_[b] = state_[b] != kRests;
  each_link([&](std::size_t a, std::size_t b) {
    if (state_[b] != kRests) is_needed_[a] = 1;
  });
  gets_forces_ = is_needed_;
  each_link([&](std::size_t a, std::size_t b) {
    if (is_needed_[a]) gets_forces_[b] = 1;
  });
}

void RestingBlocks::renew() {
  if (!changed_) return;
  changed_ = false;
  mark();
  const auto nodes = [&](const auto& wanted) {
    std::vector<node_loops::Nodes> of;
    for (const Slab& run : runs(0, state_.size(), wanted))
      of.push_back({NodeArrays::kBlock * run.begin, NodeArrays::kBlock * run.end});
    return of;
  };
  watched_.clear();
  for (std::uint32_t b = 0; b < state_.size(); ++b)
    if (state_[b] == kWatched) watched_.push_back(b);
  moving_ = nodes([&](std::size_t b) { return state_[b] == kMoves; });
  with_forces_ = nodes([&](std::size_t b) { return state_[b] != kRests; });
  spilled_ = nodes([&](std::size_t b) { return state_[b] == kRests && gets_forces_[b]; });
  for (const bool odd : {false, true}) {
    auto& to = odd ? odd_ : even_;
    to.clear();
    for (const Slab& slab : odd ? springs_->odd_slabs() : springs_->even_slabs())
      to.push_back(runs(slab.begin, slab.end, [&](std::size_t b) { return is_needed_[b] != 0; }));
  }
  const auto needed = std::count(is_needed_.begin(), is_needed_.end(), 1);
  needed_share_ = static_cast<double>(needed) / static_cast<double>(std::max<std::size_t>(1, is_needed_.size()));
}

}  // namespace palpate
