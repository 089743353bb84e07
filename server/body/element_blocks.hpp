// The stiffness blocks of elements with kNodes nodes, eight elements side by side, and their assembly into a matrix.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/doubles.hpp"
#include "server/body/block_matrix.hpp"

namespace palpate {

constexpr std::size_t pair_index(std::size_t i, std::size_t j) { return i * (i + 1) / 2 + j; }

/// c_k K + c_d D between nodes i and j <= i of each element, row by row: at[pair_index(i, j)][3 row + column].
template <std::size_t kNodes>
struct ElementBlocks {
  std::array<std::array<EightNumbers, 9>, pair_index(kNodes, 0)> at;

  void set(std::size_t i, std::size_t j, std::size_t lane, const Mat3& block) {
    for (std::size_t n = 0; n < 9; ++n)
      at[pair_index(i, j)][n].of[lane] = block(static_cast<int>(n / 3), static_cast<int>(n % 3));
  }

  /// Adds the blocks of one element, without rows and columns of held nodes. `entries` [kNodes x kNodes]: their positions in `a`.
  template <typename Entries>
  void add_to(BlockMatrix& a, std::size_t lane, const std::array<std::uint32_t, kNodes>& nodes, const Entries& entries,
              const std::vector<std::uint8_t>& held) const {
    for (std::size_t i = 0; i < kNodes; ++i) {
      if (held[nodes[i]]) continue;
      for (std::size_t j = 0; j <= i; ++j) {
        if (held[nodes[j]]) continue;
        BlockMatrix::Block k;
        for (std::size_t n = 0; n < 9; ++n) k.data()[n] = at[pair_index(i, j)][n].of[lane];
        a.block(entries[i][j]) += k;
        if (i != j) a.block(entries[j][i]) += k.transpose();
      }
    }
  }
};

}  // namespace palpate
