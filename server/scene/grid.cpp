#include "server/scene/grid.hpp"

#include <algorithm>

namespace palpate {

CellSet::CellSet(const Grid& grid, bool filled) {
  for (std::size_t a = 0; a < 3; ++a) size_[a] = std::max(1, grid.nodes[a] - 1);
  kept_.assign(static_cast<std::size_t>(size_[0] * size_[1] * size_[2]), filled);
}

bool CellSet::inside(const Index3& c) const {
  for (std::size_t a = 0; a < 3; ++a) {
    if (c[a] < 0 || c[a] >= size_[a]) return false;
  }
  return true;
}

std::size_t CellSet::count() const { return static_cast<std::size_t>(std::count(kept_.begin(), kept_.end(), 1)); }

bool CellSet::joins(const Index3& n, const Index3& d) const {
  // Along an axis where the nodes differ, one layer of cells contains both; where they agree, two do.
  const auto first = [&](std::size_t a) { return d[a] > 0 ? n[a] : n[a] - 1; };
  const auto last = [&](std::size_t a) { return d[a] < 0 ? n[a] - 1 : n[a]; };
  for (int k = first(2); k <= last(2); ++k) {
    for (int j = first(1); j <= last(1); ++j) {
      for (int i = first(0); i <= last(0); ++i) {
        if (has({i, j, k})) return true;
      }
    }
  }
  return false;
}

NumberedNodes number_nodes(const Grid& grid, const CellSet& cells) {
  NumberedNodes out;
  out.number.assign(grid.count(), kNoNode);
  grid.each([&](const Index3& n) {
    if (!cells.joins(n, {0, 0, 0})) return;
    out.number[grid.index(n)] = static_cast<std::uint32_t>(out.positions.size());
    out.positions.push_back(grid.position(n));
  });
  return out;
}

}  // namespace palpate
