// The number by which viewer and server know that they hold the same topology.
//
// FNV-1a (64 bit), fed a word at a time: the vertex count, then the three indices of every triangle in order. Enough to tell
// one topology from another; no protection against someone who wants two to agree.
#pragma once

#include <cstdint>
#include <span>

#include "common/port/patch.hpp"

namespace palpate {

inline std::uint64_t mesh_hash(std::uint64_t vertices, std::span<const Triangle> triangles) {
  constexpr std::uint64_t kPrime = 0x100000001b3u;
  std::uint64_t hash = (0xcbf29ce484222325u ^ vertices) * kPrime;
  for (const Triangle& triangle : triangles)
    for (const std::uint32_t vertex : triangle) hash = (hash ^ vertex) * kPrime;
  return hash;
}

}  // namespace palpate
