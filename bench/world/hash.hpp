// A hash of everything that a run did: equal runs have equal hashes.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/random.hpp"
#include "common/base/types.hpp"

namespace palpate {

class Hash {
 public:
  void add(std::uint64_t word) { value_ = splitmix64(value_) ^ std::rotl(word, 29); }
  void add(const Vec3& v) {
    for (int axis = 0; axis < 3; ++axis) add(std::bit_cast<std::uint64_t>(v[axis]));
  }
  void add(std::span<const std::byte> bytes) {
    for (const std::byte b : bytes) value_ = (value_ ^ std::to_integer<std::uint64_t>(b)) * 0x100000001b3ull;
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ull;
};

}  // namespace palpate
