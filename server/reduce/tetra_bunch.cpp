#include "server/reduce/tetra_bunch.hpp"

#include <algorithm>
#include <map>

namespace palpate {

TetraBunch::TetraBunch(const Dynamics& dynamics, std::span<const std::uint32_t> tetrahedra)
    : tetrahedra_(&dynamics.tetrahedra()), batches_(dynamics.tetrahedra().batches(tetrahedra)) {
  for (const std::uint32_t t : tetrahedra)
    for (const std::uint32_t i : dynamics.body().tetrahedra[t].nodes) nodes_.push_back(i);
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  const auto place = [&](std::uint32_t node) {
    return static_cast<std::uint32_t>(std::lower_bound(nodes_.begin(), nodes_.end(), node) - nodes_.begin());
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known;
  for (const Tetrahedra::Batch& batch : batches_)
    for (std::size_t lane = 0; lane < batch.group.count; ++lane) {
      Targets& targets = targets_.emplace_back();
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j <= i; ++j) {
          const std::uint32_t row = place(batch.group.nodes[i][lane]), column = place(batch.group.nodes[j][lane]);
          const auto [link, fresh] = known.try_emplace(std::minmax(row, column), static_cast<std::uint32_t>(links_.size()));
          if (fresh) links_.push_back({std::min(row, column), std::max(row, column)});
          targets[pair_index(i, j)] = 2 * link->second + (row > column ? 1 : 0);
        }
    }
}

TetraBunch::Pair TetraBunch::transposed(const Pair& pair) {
  Pair other;
  for (int half = 0; half < 2 * kNumbers; half += kNumbers)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) other[half + 3 * r + c] = pair[half + 3 * c + r];
  return other;
}

std::vector<TetraBunch::Pair> TetraBunch::sums(const Vector& x, bool clamp) const {
  std::vector<Pair> sums(links_.size(), Pair::Zero());
  TetraBlocks k, d;
  auto targets = targets_.begin();
  for (const Tetrahedra::Batch& batch : batches_) {
    tetrahedra_->blocks(batch, x, 0, 1, clamp, k);
    tetrahedra_->blocks(batch, x, 1, 0, clamp, d);
    for (std::size_t lane = 0; lane < batch.group.count; ++lane, ++targets)
      for (std::size_t p = 0; p < targets->size(); ++p) {
        Pair& to = sums[(*targets)[p] / 2];
        const bool turned = (*targets)[p] % 2 != 0;
        for (std::size_t n = 0; n < kNumbers; ++n) {
          const std::size_t at = turned ? 3 * (n % 3) + n / 3 : n;
          to[static_cast<Eigen::Index>(n)] += k.at[p][at].of[lane];
          to[static_cast<Eigen::Index>(n + kNumbers)] += d.at[p][at].of[lane];
        }
      }
  }
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
