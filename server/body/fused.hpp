// Multiply-adds that are rounded once where the processor that the build is for has them, for kernels whose time is
// multiplications and additions and that only a server runs (docs/decisions/0005-no-fp-contraction.md). Elsewhere two roundings.
#pragma once

#ifdef __FMA__
#include <immintrin.h>
#endif

namespace palpate {

/// Eight floats as one value; where the processor is narrower the compiler makes two of it. Never passed by value to or from a
/// function that is not inlined: how that is done depends on the processor that is compiled for.
using EightFloats = float __attribute__((vector_size(32), may_alias));
using FourDoubles = double __attribute__((vector_size(32), may_alias));

/// c += a b
[[gnu::always_inline]] inline void add_product(const EightFloats& a, const EightFloats& b, EightFloats& c) {
#ifdef __FMA__
  c = reinterpret_cast<EightFloats>(
      _mm256_fmadd_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b), reinterpret_cast<__m256>(c)));
#else
  c += a * b;
#endif
}
[[gnu::always_inline]] inline void add_product(const FourDoubles& a, const FourDoubles& b, FourDoubles& c) {
#ifdef __FMA__
  c = reinterpret_cast<FourDoubles>(
      _mm256_fmadd_pd(reinterpret_cast<__m256d>(a), reinterpret_cast<__m256d>(b), reinterpret_cast<__m256d>(c)));
#else
  c += a * b;
#endif
}
[[gnu::always_inline]] inline void add_product(float a, const EightFloats& b, EightFloats& c) {
  add_product(EightFloats{a, a, a, a, a, a, a, a}, b, c);
}
[[gnu::always_inline]] inline void add_product(double a, const FourDoubles& b, FourDoubles& c) {
  add_product(FourDoubles{a, a, a, a}, b, c);
}

}  // namespace palpate
