// Eight tetrahedra of one material side by side: the forces and the exact tangents of tetra_kernel.hpp.
//
// An element needs some 300 operations and no decision but when to stop (polar_lanes.hpp), so they are the elements that go into
// the lanes of the vectors: two, four or eight a time, the most that the processor has. Nothing is contracted and every lane does
// the same in the same order until it stops: same bits whatever the width and the neighbours.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/base/doubles.hpp"
#include "server/body/element_blocks.hpp"
#include "server/body/tetra_kernel.hpp"

namespace palpate {

inline constexpr std::size_t kTetraLanes = 8;

struct TetraGroup {
  std::array<std::array<EightNumbers, 3>, 3> b;                   ///< component c of b_1, b_2, b_3: b[i - 1][c] [1/m]
  EightNumbers volume_m3;                                         ///< V
  std::array<std::array<std::uint32_t, kTetraLanes>, 4> nodes{};  ///< of lanes that are not used: those of the first
  std::uint32_t material = 0, count = 0;                          ///< lanes that are used
};

using TetraBlocks = ElementBlocks<4>;

struct TetraLoops {
  std::size_t width;  ///< elements in a vector
  /// f += forces at positions x and velocities v, 3 N each.
  void (*add_forces)(const TetraMaterial& material, const TetraGroup& group, const double* x, const double* v, double* f);
  /// Not clamped. A bit for each lane that is good: the rest are corotational ones that kLeastPairSum cuts, which wants
  /// eigenvectors.
  std::uint32_t (*blocks)(const TetraMaterial& material, const TetraGroup& group, const double* x, double c_d, double c_k,
                          TetraBlocks& blocks);
};

/// All that this processor can run, the widest last.
std::span<const TetraLoops> tetra_loops();

}  // namespace palpate
