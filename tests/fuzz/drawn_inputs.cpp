// Runs a fuzzer's harness without libFuzzer: randomly drawn inputs, the same in every run, each made from the one before it. A
// broken promise aborts, as under libFuzzer.
//
// usage: fuzz_NAME INPUTS BYTES [SEED]: INPUTS inputs of at most BYTES bytes; another seed draws others
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" __attribute__((weak)) std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                                                     unsigned seed);
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

std::mt19937& chance() {
  static std::mt19937 random(20);
  return random;
}

std::size_t below(std::size_t most) { return chance()() % most; }

}  // namespace

/// Changes, inserts or removes some bytes.
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size) {
  const std::size_t bytes = 1 + below(8);
  switch (size == 0 ? 1 : below(4)) {
    case 0: {
      const std::size_t gone = std::min(bytes, size), at = below(size - gone + 1);
      std::memmove(data + at, data + at + gone, size - at - gone);
      return size - gone;
    }
    case 1: {
      const std::size_t more = std::min(size == 0 ? 1 + below(64) : bytes, max_size - size), at = below(size + 1);
      std::memmove(data + at + more, data + at, size - at);
      std::generate_n(data + at, more, [] { return static_cast<std::uint8_t>(chance()()); });
      return size + more;
    }
    default:
      for (std::size_t k = 0; k < bytes; ++k) data[below(size)] = static_cast<std::uint8_t>(chance()() >> 8);
      return size;
  }
}

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) return std::fprintf(stderr, "usage: %s INPUTS BYTES [SEED]\n", argv[0]), 2;
  if (argc == 4) chance().seed(static_cast<unsigned>(std::atoi(argv[3])));
  const long inputs = std::atol(argv[1]);
  std::vector<std::uint8_t> data(static_cast<std::size_t>(std::atoi(argv[2])));
  std::size_t size = 0;
  for (long k = 0; k < inputs; ++k) {
    // Every fourth begins with a file of the harness's own, which it uses at multiples of 64.
    const auto seed = static_cast<unsigned>(k % 4 == 0 ? 64 * (k / 4) : 1 + below(62));
    size = LLVMFuzzerCustomMutator ? LLVMFuzzerCustomMutator(data.data(), size, data.size(), seed)
                                   : LLVMFuzzerMutate(data.data(), k % 64 == 0 ? 0 : size, data.size());
    LLVMFuzzerTestOneInput(data.data(), size);
  }
  std::printf("%ld inputs\n", inputs);
  return 0;
}
