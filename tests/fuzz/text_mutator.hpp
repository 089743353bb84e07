// Mutations of text files: sometimes starts from a valid file, or inserts a word of the format.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace palpate::test {

inline std::size_t mutate_text(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed,
                               const std::vector<std::string>& files, const std::vector<std::string_view>& words) {
  const unsigned drawn = seed * 2654435761u >> 8;
  if (seed % 64 == 0 || size == 0) {
    const std::string& file = files[drawn % files.size()];
    size = std::min(file.size(), max_size);
    std::memcpy(data, file.data(), size);
  }
  if (seed % 4 == 1) {
    const std::string_view word = words[drawn % words.size()];
    const std::size_t at = drawn / 64 % (size + 1);
    if (size + word.size() <= max_size) {
      std::memmove(data + at + word.size(), data + at, size - at);
      std::memcpy(data + at, word.data(), word.size());
      return size + word.size();
    }
  }
  return LLVMFuzzerMutate(data, size, max_size);
}

}  // namespace palpate::test
