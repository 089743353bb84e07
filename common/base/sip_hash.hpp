// SipHash-2-4 (Aumasson and Bernstein, "SipHash: a fast short-input PRF", 2012): a keyed hash of 64 bits. Who does not know the
// key can neither say the hash of anything nor find two inputs of the same.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace palpate {

struct SipKey {
  std::uint64_t k0 = 0, k1 = 0;
};

class SipState {
 public:
  explicit constexpr SipState(SipKey key)
      : v_{key.k0 ^ 0x736f6d6570736575ull, key.k1 ^ 0x646f72616e646f6dull, key.k0 ^ 0x6c7967656e657261ull,
           key.k1 ^ 0x7465646279746573ull} {}
  constexpr void take(std::uint64_t word) {
    v_[3] ^= word;
    rounds(2);
    v_[0] ^= word;
  }
  constexpr std::uint64_t finish() {
    v_[2] ^= 0xff;
    rounds(4);
    return v_[0] ^ v_[1] ^ v_[2] ^ v_[3];
  }

 private:
  constexpr void rounds(int count) {
    for (int k = 0; k < count; ++k) {
      v_[0] += v_[1], v_[2] += v_[3];
      v_[1] = std::rotl(v_[1], 13) ^ v_[0], v_[3] = std::rotl(v_[3], 16) ^ v_[2];
      v_[0] = std::rotl(v_[0], 32);
      v_[2] += v_[1], v_[0] += v_[3];
      v_[1] = std::rotl(v_[1], 17) ^ v_[2], v_[3] = std::rotl(v_[3], 21) ^ v_[0];
      v_[2] = std::rotl(v_[2], 32);
    }
  }
  std::uint64_t v_[4];
};

constexpr std::uint64_t sip_hash(SipKey key, std::span<const std::uint8_t> bytes) {
  SipState state(key);
  std::uint64_t word = 0;
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    word |= std::uint64_t{bytes[k]} << 8 * (k % 8);
    if (k % 8 == 7) {
      state.take(word);
      word = 0;
    }
  }
  state.take(word | std::uint64_t{bytes.size()} << 56);
  return state.finish();
}

}  // namespace palpate
