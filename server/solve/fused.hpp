// Fused multiply-adds, rounded once, if the target processor has them; otherwise they round twice. For kernels bound by
// multiplications and additions that only a server runs (docs/decisions/0005-no-fp-contraction.md).
#pragma once

#ifdef __FMA__
#include <immintrin.h>
#endif

namespace palpate {

/// Eight floats as one value; on narrower processors the compiler splits it into two. Never pass it by value to or from a
/// function that is not inlined: the calling convention depends on the target processor.
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
