// Eight hexahedra of one material side by side: the forces and the exact tangents of hexa_kernel.hpp.
//
// Each lane of a vector holds one element, and the bits do not depend on the width or the neighbours. The
// cells of a lattice are boxes of one shape, except those at a clipped surface: a group of one shape stores its numbers once.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/doubles.hpp"
#include "server/body/element_blocks.hpp"
#include "server/body/hexa_kernel.hpp"

namespace palpate {

inline constexpr std::size_t kHexaLanes = 8;

/// The constants of an element; many elements of a body may share them.
struct HexaShape {
  HexaShape(const SolidMaterial& material, std::uint32_t material_index, const HexaRest& rest);
  HexaRest rest;
  Hourglass modes;
  std::uint32_t material;
};

struct HexaGroup {
  const HexaShape* shape = nullptr;                              ///< shared by all elements of the group, or null
  std::vector<EightNumbers> numbers;                             ///< one lane each: V, k_a, g_i; empty if they share a shape
  std::array<std::array<std::uint32_t, kHexaLanes>, 8> nodes{};  ///< unused lanes repeat the first
  std::uint32_t material = 0, count = 0;                         ///< number of lanes in use
  double damping_s = 0;
};

/// Positions in numbers_of().
inline constexpr std::size_t kHexaVolumeAt = 0, kHexaModesAt = 1, kHexaGradientsAt = kHexaModesAt + kModesOfHexa,
                             kNumbersOfHexa = kHexaGradientsAt + 56;
constexpr std::size_t hexa_gradient_at(std::size_t node, std::size_t m) { return kHexaGradientsAt + 7 * node + m; }

/// Returns the numbers of up to eight elements, each with its own shape; 0 in unused lanes.
std::vector<EightNumbers> numbers_of(std::span<const HexaShape* const> shapes);

using HexaBlocks = ElementBlocks<8>;

struct HexaLoops {
  std::size_t width;  ///< elements per vector
  /// f += forces at positions x and velocities v, 3 N each.
  void (*add_forces)(const TetraMaterial& material, const HexaGroup& group, const double* x, const double* v, double* f);
  /// Blocks without clamping. Returns a bit for each valid lane, as in TetraLoops.
  std::uint32_t (*blocks)(const TetraMaterial& material, const HexaGroup& group, const double* x, double c_d, double c_k,
                          HexaBlocks& blocks);
};

/// Returns the variants that this processor can run, the widest last.
std::span<const HexaLoops> hexa_loops();

}  // namespace palpate
