#include "server/reduction/refined_tangents.hpp"

#include <algorithm>
#include <cassert>

#include "server/reduction/refined_body.hpp"

namespace palpate {

RefinedPattern::RefinedPattern(const RefinedBody& body, std::vector<Pair> near_pairs, std::vector<Border> borders)
    : borders_(std::move(borders)) {
  std::sort(borders_.begin(), borders_.end());
  borders_.erase(std::unique(borders_.begin(), borders_.end()), borders_.end());
  const FarField& far = body.far();
  std::vector<Pair> pairs = std::move(near_pairs);
  for (const auto& [row, cell] : borders_)
    for (const std::uint32_t corner : far.corners_of(cell)) pairs.emplace_back(row, body.corner(corner));
  const auto each_corner_pair = [&](std::uint32_t cell, const auto& visit) {
    const auto& corners = far.corners_of(cell);
    for (std::size_t p = 0; p < corners.size(); ++p)
      for (std::size_t q = p; q < corners.size(); ++q) visit(body.corner(corners[p]), body.corner(corners[q]));
  };
  for (std::uint32_t c = 0; c < far.cells(); ++c)
    if (!body.near()[c])
      each_corner_pair(c, [&](std::uint32_t p, std::uint32_t q) {
        if (p != q) pairs.emplace_back(p, q);
      });
  pattern_ = BlockPattern(body.size(), pairs, Triangles::upper);
  for (const auto& [row, cell] : borders_)
    for (const std::uint32_t corner : far.corners_of(cell)) border_entries_.push_back(entry(row, body.corner(corner)));
  corner_entries_.assign(kCornerPairs * far.cells(), RefinedBody::kNone);
  for (std::uint32_t c = 0; c < far.cells(); ++c) {
    if (body.near()[c]) continue;
    std::uint32_t* to = &corner_entries_[kCornerPairs * c];
    each_corner_pair(c, [&](std::uint32_t p, std::uint32_t q) { *to++ = entry(p, q); });
  }
}

std::uint32_t RefinedPattern::border(const Border& border) const {
  assert(std::binary_search(borders_.begin(), borders_.end(), border));
  return static_cast<std::uint32_t>(std::lower_bound(borders_.begin(), borders_.end(), border) - borders_.begin());
}

}  // namespace palpate
