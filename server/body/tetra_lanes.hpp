// Eight tetrahedra of one material side by side: the forces and the exact tangents of tetra_kernel.hpp.
//
// An element needs some 300 operations and no branch but the end of an iteration (polar_lanes.hpp), so each lane of a vector
// holds one element: two, four or eight at a time, as the processor allows. Nothing is contracted and every lane does the same in
// the same order until it stops: the bits do not depend on the width or the neighbours.
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
  std::array<std::array<std::uint32_t, kTetraLanes>, 4> nodes{};  ///< unused lanes repeat the first
  std::uint32_t material = 0, count = 0;                          ///< number of lanes in use
};

using TetraBlocks = ElementBlocks<4>;

struct TetraLoops {
  std::size_t width;  ///< elements per vector
  /// Adds forces to f at positions x and velocities v, 3 N each.
  void (*add_forces)(const TetraMaterial& material, const TetraGroup& group, const double* x, const double* v, double* f);
  /// Blocks without clamping. Returns a bit for each valid lane: the others are corotational ones that kLeastPairSum cuts, which
  /// need eigenvectors.
  std::uint32_t (*blocks)(const TetraMaterial& material, const TetraGroup& group, const double* x, double c_d, double c_k,
                          TetraBlocks& blocks);
};

/// Returns the variants that this processor can run, the widest last.
std::span<const TetraLoops> tetra_loops();

}  // namespace palpate
