// A regular grid of nodes and the cells between them.
//
// Node (i, j, k) has index i + nx (j + ny k) and rests at origin + (i, j, k) * size / (nodes - 1). Cell (i, j, k) has node (i, j,
// k) as its lowest corner. A sheet has nz = 1 and one layer of cells, of which only the lower nodes exist.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

using Index3 = std::array<int, 3>;

struct Grid {
  Index3 nodes{};
  Vec3 origin = Vec3::Zero(), size = Vec3::Zero();

  std::size_t index(const Index3& n) const {
    return static_cast<std::size_t>(n[0]) +
           static_cast<std::size_t>(nodes[0]) *
               (static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(nodes[1]) * static_cast<std::size_t>(n[2]));
  }
  std::size_t count() const { return index({0, 0, nodes[2]}); }
  Vec3 position(const Index3& n) const {
    Vec3 p = origin;
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      if (nodes[i] > 1) p[a] += n[i] * size[a] / (nodes[i] - 1);
    }
    return p;
  }
  /// Distance of neighbouring nodes along each axis; 0 along an axis with a single node.
  Vec3 spacing() const {
    Vec3 h;
    for (int a = 0; a < 3; ++a) h[a] = size[a] / std::max(1, nodes[static_cast<std::size_t>(a)] - 1);
    return h;
  }
  /// Calls f(Index3) for every node in the order of the index.
  template <class F>
  void each(F&& f) const {
    for (int k = 0; k < nodes[2]; ++k) {
      for (int j = 0; j < nodes[1]; ++j) {
        for (int i = 0; i < nodes[0]; ++i) f(Index3{i, j, k});
      }
    }
  }
};

/// Set of the cells of a grid that belong to the body; there are none outside the grid.
class CellSet {
 public:
  CellSet(const Grid& grid, bool filled);

  const Index3& size() const { return size_; }
  bool has(const Index3& c) const { return inside(c) && kept_[index(c)]; }
  void set(const Index3& c, bool kept) { kept_[index(c)] = kept; }
  bool inside(const Index3& c) const;
  std::size_t count() const;

  /// Returns true if some cell of the set has both node n and node n + d as corners (d in -1, 0, 1 per axis).
  bool joins(const Index3& n, const Index3& d) const;

  template <class F>
  void each(F&& f) const {
    for (int k = 0; k < size_[2]; ++k) {
      for (int j = 0; j < size_[1]; ++j) {
        for (int i = 0; i < size_[0]; ++i) f(Index3{i, j, k});
      }
    }
  }

 private:
  std::size_t index(const Index3& c) const { return static_cast<std::size_t>(c[0] + size_[0] * (c[1] + size_[1] * c[2])); }
  Index3 size_;
  std::vector<std::uint8_t> kept_;
};

inline constexpr std::uint32_t kNoNode = ~std::uint32_t{0};

struct NumberedNodes {
  std::vector<std::uint32_t> number;  ///< number of every grid node, kNoNode if it is no corner of a cell of the set
  std::vector<Vec3> positions;        ///< positions on the grid
};
NumberedNodes number_nodes(const Grid& grid, const CellSet& cells);

inline Index3 operator+(const Index3& a, const Index3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

}  // namespace palpate
