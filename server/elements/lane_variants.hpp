// Loops over lanes of two, four and eight doubles, each compiled for a processor that has such vectors.
//
// A loop is a type with a function for every width that the compiler inlines, and that calls no other function which is not
// inlined or compiled by Variants too:
//
//     struct Loop {
//       template <std::size_t N> PALPATE_INLINE static void run(Arguments...);
//     };
//     Variants<Loop>::widest<Arguments...>()(arguments...);      // the widest that this processor can run
//     Variants<Loop>::at<N>(arguments...);                       // from a loop of the same width
//
// Nothing is contracted and every lane does the same in the same order: the bits do not depend on the width.
#pragma once

#include <span>
#include <vector>

#include "common/base/doubles.hpp"

#if defined(__x86_64__)
#define PALPATE_AVX2 __attribute__((target("avx2")))
#define PALPATE_AVX512 __attribute__((target("avx512f")))
#else
#define PALPATE_AVX2
#define PALPATE_AVX512
#endif

namespace palpate {

/// A loop compiled for vectors of so many doubles.
template <typename... Arguments>
struct Variant {
  std::size_t width;
  void (*run)(Arguments...);
};

template <class Loop>
class Variants {
 public:
  template <std::size_t N, typename... Arguments>
  PALPATE_INLINE static void at(Arguments&&... arguments) {
    if constexpr (N == 2)
      two<Arguments&&...>(static_cast<Arguments&&>(arguments)...);
    else if constexpr (N == 4)
      four<Arguments&&...>(static_cast<Arguments&&>(arguments)...);
    else
      eight<Arguments&&...>(static_cast<Arguments&&>(arguments)...);
  }
  /// Returns the variants that this processor can run, the widest last.
  template <typename... Arguments>
  static std::span<const Variant<Arguments...>> all() {
    static const std::vector<Variant<Arguments...>> found = [] {
      std::vector<Variant<Arguments...>> variants{{2, &two<Arguments...>}};
#if defined(__x86_64__)
      if (__builtin_cpu_supports("avx2")) variants.push_back({4, &four<Arguments...>});
      if (__builtin_cpu_supports("avx512f")) variants.push_back({8, &eight<Arguments...>});
#endif
      return variants;
    }();
    return found;
  }
  template <typename... Arguments>
  static auto widest() {
    return all<Arguments...>().back().run;
  }

 private:
  template <typename... Arguments>
  static void two(Arguments... arguments) {
    Loop::template run<2>(arguments...);
  }
  template <typename... Arguments>
  PALPATE_AVX2 static void four(Arguments... arguments) {
    Loop::template run<4>(arguments...);
  }
  template <typename... Arguments>
  PALPATE_AVX512 static void eight(Arguments... arguments) {
    Loop::template run<8>(arguments...);
  }
};

}  // namespace palpate
