// Arbitrary descriptors and reports of a HID device: they are refused or read, and values read are finite and in bounds. The
// first two bytes give the length of the descriptor; the rest are reports.
#include <algorithm>
#include <cstring>

#include "tests/client/device/hid/try_hid.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const auto bytes = std::as_bytes(std::span(data, size)).subspan(2);
  const std::size_t descriptor = std::min(bytes.size(), std::size_t{data[0]} | std::size_t{data[1]} << 8);
  palpate::test::try_hid(bytes.first(descriptor), bytes.subspan(descriptor));
  return 0;
}

/// Sometimes starts from a device of ours.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  static const auto descriptors = palpate::test::known_descriptors();
  static const auto words = palpate::test::known_words();
  if (seed % 32 == 0 || size < 20) {
    const auto& descriptor = descriptors[seed / 32 % descriptors.size()];
    size = 2 + descriptor.size() + words.size();
    if (size > max_size) return LLVMFuzzerMutate(data, 0, max_size);
    data[0] = static_cast<std::uint8_t>(descriptor.size());
    data[1] = static_cast<std::uint8_t>(descriptor.size() >> 8);
    std::memcpy(data + 2, descriptor.data(), descriptor.size());
    std::memcpy(data + 2 + descriptor.size(), words.data(), words.size());
  }
  return LLVMFuzzerMutate(data, size, max_size);
}
