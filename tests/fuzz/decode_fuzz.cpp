// Arbitrary bytes: decode() neither crashes nor accepts a message that encode() would round differently the second time.
#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "tests/common/wire/seeds.hpp"

using namespace palpate;

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Message message;
  if (decode(std::as_bytes(std::span(data, size)), message) != WireFault::none) return 0;
  const auto ours = seeds::bytes_of(message);  // empty if the foreign layout held more than ours can
  if (ours.empty() || decode(ours, message) != WireFault::none) return 0;
  if (seeds::bytes_of(message) != ours) std::abort();
  return 0;
}

/// Sometimes starts from a datagram of ours, as random bytes would rarely resemble one.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  static const auto kinds = seeds::every_kind();
  if (seed % 32 == 0 || size < 20) {
    const auto bytes = seeds::bytes_of(kinds[seed / 32 % kinds.size()]);
    size = std::min(bytes.size(), max_size);
    std::memcpy(data, bytes.data(), size);
  }
  return LLVMFuzzerMutate(data, size, max_size);
}
