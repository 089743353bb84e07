#include "server/reduce/tetra_bunch.hpp"

#include <algorithm>
#include <map>

#include "server/reduce/local_body.hpp"

namespace palpate {

TetraBunch::TetraBunch(const Dynamics& dynamics, std::span<const std::uint32_t> elements) : dynamics_(&dynamics) {
  std::array<std::uint32_t, 2> room;
  for (const std::uint32_t e : elements)
    for (const std::uint32_t i : nodes_of(dynamics.body(), e, room)) nodes_.push_back(i);
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  if (!dynamics.tetrahedra().empty()) tetrahedra_ = dynamics.tetrahedra().batches(elements);
  if (!dynamics.hexahedra().empty()) hexahedra_ = dynamics.hexahedra().batches(elements);
  take_links(tetrahedra_);
  take_links(hexahedra_);
}

template <typename Batch>
void TetraBunch::take_links(const std::vector<Batch>& batches) {
  const auto place = [&](std::uint32_t node) {
    return static_cast<std::uint32_t>(std::lower_bound(nodes_.begin(), nodes_.end(), node) - nodes_.begin());
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known;
  for (const Batch& batch : batches)
    for (std::size_t lane = 0; lane < batch.group.count; ++lane)
      for (std::size_t i = 0; i < batch.group.nodes.size(); ++i)
        for (std::size_t j = 0; j <= i; ++j) {
          const std::uint32_t row = place(batch.group.nodes[i][lane]), column = place(batch.group.nodes[j][lane]);
          const auto [link, fresh] = known.try_emplace(std::minmax(row, column), static_cast<std::uint32_t>(links_.size()));
          if (fresh) links_.push_back({std::min(row, column), std::max(row, column)});
          targets_.push_back(2 * link->second + (row > column ? 1 : 0));  // at pair_index(i, j)
        }
}

TetraBunch::Pair TetraBunch::transposed(const Pair& pair) {
  Pair other;
  for (int half = 0; half < 2 * kNumbers; half += kNumbers)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) other[half + 3 * r + c] = pair[half + 3 * c + r];
  return other;
}

template <typename Elements>
void TetraBunch::add_sums(const Elements& elements, const std::vector<typename Elements::Batch>& batches, const Vector& x,
                          bool clamp, std::vector<Pair>& sums) const {
  typename Elements::Blocks k, d;
  auto target = targets_.begin();
  for (const auto& batch : batches) {
    elements.blocks(batch, x, 0, 1, clamp, k);
    elements.blocks(batch, x, 1, 0, clamp, d);
    for (std::size_t lane = 0; lane < batch.group.count; ++lane)
      for (std::size_t p = 0; p < k.at.size(); ++p, ++target) {
        Pair& to = sums[*target / 2];
        const bool turned = *target % 2 != 0;
        for (std::size_t n = 0; n < kNumbers; ++n) {
          const std::size_t at = turned ? 3 * (n % 3) + n / 3 : n;
          to[static_cast<Eigen::Index>(n)] += k.at[p][at].of[lane];
          to[static_cast<Eigen::Index>(n + kNumbers)] += d.at[p][at].of[lane];
        }
      }
  }
}

std::vector<TetraBunch::Pair> TetraBunch::sums(const Vector& x, bool clamp) const {
  std::vector<Pair> sums(links_.size(), Pair::Zero());
  add_sums(dynamics_->tetrahedra(), tetrahedra_, x, clamp, sums);
  add_sums(dynamics_->hexahedra(), hexahedra_, x, clamp, sums);
  return sums;
}

void add_over_corners(const TetraBunch& bunch, std::span<const TetraBunch::Pair> sums, std::span<const FarField::Shape> shapes,
                      CornerTangent<TetraBunch::kNumbers>& to) {
  using Pair = TetraBunch::Pair;
  std::vector<std::array<Pair, FarField::kCorners>> a_n(bunch.nodes().size());
  for (auto& row : a_n) row.fill(Pair::Zero());
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const auto [a, b] = bunch.links()[k];
    for (std::size_t q = 0; q < FarField::kCorners; ++q) a_n[a][q] += shapes[b][static_cast<Eigen::Index>(q)] * sums[k];
    if (a == b) continue;
    const Pair back = TetraBunch::transposed(sums[k]);
    for (std::size_t q = 0; q < FarField::kCorners; ++q) a_n[b][q] += shapes[a][static_cast<Eigen::Index>(q)] * back;
  }
  for (std::size_t i = 0; i < a_n.size(); ++i) {
    auto pair = to.begin();
    for (std::size_t p = 0; p < FarField::kCorners; ++p)
      for (std::size_t q = p; q < FarField::kCorners; ++q) *pair++ += shapes[i][static_cast<Eigen::Index>(p)] * a_n[i][q];
  }
}

}  // namespace palpate
