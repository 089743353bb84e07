// Random numbers with the same bits on every machine: the distributions of <random> differ.
//
// xoshiro256** (Blackman and Vigna, "Scrambled linear pseudorandom number generators", 2018), seeded by splitmix64 as its authors
// advise. Every simulated part owns a generator with its own seed.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <functional>

namespace palpate {

/// Steps `state` and returns its next output; also good for deriving seeds.
constexpr std::uint64_t splitmix64(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15ull);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

class Random {
 public:
  constexpr explicit Random(std::uint64_t seed) {
    for (auto& word : state_) word = splitmix64(seed);
  }
  /// Continues from a complete state (not all zero).
  constexpr explicit Random(const std::array<std::uint64_t, 4>& state) : state_(state) {}

  constexpr std::uint64_t bits() {
    const std::uint64_t result = std::rotl(state_[1] * 5, 7) * 9;
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }
  /// Uniform in [0, 1), 53 bits.
  constexpr double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// True with the given probability.
  constexpr bool chance(double probability) { return uniform() < probability; }

 private:
  std::array<std::uint64_t, 4> state_{};
};

/// Draws numbers that nobody can guess; in virtual time numbers that repeat.
using SecretSource = std::function<std::uint64_t()>;
inline SecretSource repeatable(std::uint64_t seed) {
  return [random = Random(seed)]() mutable { return random.bits(); };
}

}  // namespace palpate
