#include "server/operators/element_subset.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <map>

#include "server/operators/local_body.hpp"

namespace palpate {

ElementSubset::ElementSubset(const Dynamics& dynamics, std::span<const std::uint32_t> elements) : dynamics_(&dynamics) {
  const LumpedBody& body = dynamics.body();
  const auto hexahedra = static_cast<std::uint32_t>(body.hexahedra.size());
  std::vector<std::uint32_t> of_springs, of_tetrahedra, of_hexahedra;
  std::array<std::uint32_t, 2> scratch;
  for (const std::uint32_t e : elements) {
    for (const std::uint32_t i : nodes_of(body, e, scratch)) nodes_.push_back(i);
    if (!body.is_solid())
      of_springs.push_back(e);
    else if (e < hexahedra)
      of_hexahedra.push_back(e);
    else
      of_tetrahedra.push_back(e - hexahedra);
  }
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  if (!of_springs.empty()) springs_ = dynamics.springs().batches(of_springs);
  if (!of_tetrahedra.empty()) tetrahedra_ = dynamics.tetrahedra().batches(of_tetrahedra);
  if (!of_hexahedra.empty()) hexahedra_ = dynamics.hexahedra().batches(of_hexahedra);
  find_links();
}

void ElementSubset::find_links() {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known;
  const auto index = [&](std::uint32_t node) {
    return static_cast<std::uint32_t>(std::lower_bound(nodes_.begin(), nodes_.end(), node) - nodes_.begin());
  };
  const auto add_batches = [&](const auto& batches) {
    for (const auto& batch : batches)
      for (std::size_t lane = 0; lane < batch.group.count; ++lane)
        for (std::size_t i = 0; i < batch.group.nodes.size(); ++i)
          for (std::size_t j = 0; j <= i; ++j) {
            const std::uint32_t row = index(batch.group.nodes[i][lane]), column = index(batch.group.nodes[j][lane]);
            const auto [link, fresh] = known.try_emplace(std::minmax(row, column), static_cast<std::uint32_t>(links_.size()));
            if (fresh) links_.push_back({std::min(row, column), std::max(row, column)});
            targets_.push_back(2 * link->second + (row > column ? 1 : 0));
          }
  };
  add_batches(springs_);
  add_batches(tetrahedra_);
  add_batches(hexahedra_);
}

ElementSubset::Pair ElementSubset::transposed(const Pair& pair) {
  Pair other;
  for (int half = 0; half < 18; half += 9)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) other[half + 3 * r + c] = pair[half + 3 * c + r];
  return other;
}

template <typename Elements>
void ElementSubset::add_batches(const Elements& elements, const std::vector<typename Elements::Batch>& batches,
                                const BodyState& state, bool clamp, Target& target, std::vector<Pair>& sums) const {
  typename Elements::Blocks k, d;
  for (const auto& batch : batches) {
    elements.blocks(batch, state, 0, 1, clamp, k);
    elements.blocks(batch, state, 1, 0, clamp, d);
    for (std::size_t lane = 0; lane < batch.group.count; ++lane)
      for (std::size_t p = 0; p < k.at.size(); ++p, ++target) {
        Pair& to = sums[*target / 2];
        const bool turned = *target % 2 != 0;
        for (std::size_t n = 0; n < 9; ++n) {
          const std::size_t at = turned ? 3 * (n % 3) + n / 3 : n;
          to[static_cast<Eigen::Index>(n)] += k.at[p][at].of[lane];
          to[static_cast<Eigen::Index>(n + 9)] += d.at[p][at].of[lane];
        }
      }
  }
}

std::vector<ElementSubset::Pair> ElementSubset::sums(const BodyState& state, bool clamp) const {
  std::vector<Pair> sums(links_.size(), Pair::Zero());
  auto target = targets_.begin();
  add_batches(dynamics_->springs(), springs_, state, clamp, target, sums);
  add_batches(dynamics_->tetrahedra(), tetrahedra_, state, clamp, target, sums);
  add_batches(dynamics_->hexahedra(), hexahedra_, state, clamp, target, sums);
  return sums;
}

}  // namespace palpate
