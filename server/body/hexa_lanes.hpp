// Eight hexahedra of one material side by side: the forces and the exact tangents of hexa_kernel.hpp.
//
// As tetra_lanes.hpp: elements are what goes into the lanes of the vectors, and the bits are the same whatever the width and the
// neighbours. Cells of a lattice are boxes of one shape, all but those at a clipped surface: a group of one shape has its numbers
// once.
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

/// An element, of which a body may have many.
struct HexaShape {
  HexaShape(const SolidMaterial& material, std::uint32_t material_index, const HexaRest& rest);
  HexaRest rest;
  Hourglass modes;
  std::uint32_t material;
};

struct HexaGroup {
  const HexaShape* shape = nullptr;                              ///< of all, or
  std::vector<EightNumbers> numbers;                             ///< a lane each: V, k_a, g_i; empty where they share a shape
  std::array<std::array<std::uint32_t, kHexaLanes>, 8> nodes{};  ///< of lanes that are not used: those of the first
  std::uint32_t material = 0, count = 0;                         ///< lanes that are used
  double damping_s = 0;
};

/// Where in numbers_of() things are.
inline constexpr std::size_t kHexaVolumeAt = 0, kHexaModesAt = 1, kHexaGradientsAt = kHexaModesAt + kModesOfHexa,
                             kNumbersOfHexa = kHexaGradientsAt + 56;
constexpr std::size_t hexa_gradient_at(std::size_t node, std::size_t m) { return kHexaGradientsAt + 7 * node + m; }

/// The numbers of up to eight elements of their own shape; 0 in lanes that are not used.
std::vector<EightNumbers> numbers_of(std::span<const HexaShape* const> shapes);

using HexaBlocks = ElementBlocks<8>;

struct HexaLoops {
  std::size_t width;  ///< elements in a vector
  /// f += forces at positions x and velocities v, 3 N each.
  void (*add_forces)(const TetraMaterial& material, const HexaGroup& group, const double* x, const double* v, double* f);
  /// Not clamped. A bit for each lane that is good, as TetraLoops has it.
  std::uint32_t (*blocks)(const TetraMaterial& material, const HexaGroup& group, const double* x, double c_d, double c_k,
                          HexaBlocks& blocks);
};

/// All that this processor can run, the widest last.
std::span<const HexaLoops> hexa_loops();

}  // namespace palpate
