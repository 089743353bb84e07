// Vectors of two, four or eight doubles, for loops that are compiled for each width and selected at program start: the same
// arithmetic in every lane, no contraction, so the same bits for every width.
#pragma once

#include <cstddef>

#define PALPATE_INLINE [[gnu::always_inline]] inline

namespace palpate {

template <std::size_t N>
struct VectorOf;
template <>
struct VectorOf<2> {
  using Type = double __attribute__((vector_size(16), may_alias));
};
template <>
struct VectorOf<4> {
  using Type = double __attribute__((vector_size(32), may_alias));
};
template <>
struct VectorOf<8> {
  using Type = double __attribute__((vector_size(64), may_alias));
};
template <std::size_t N>
using Doubles = typename VectorOf<N>::Type;

/// N doubles in memory, aligned to their size.
template <std::size_t N>
PALPATE_INLINE Doubles<N>& doubles(double* at) {
  return *reinterpret_cast<Doubles<N>*>(at);
}
template <std::size_t N>
PALPATE_INLINE const Doubles<N>& doubles(const double* at) {
  return *reinterpret_cast<const Doubles<N>*>(at);
}

/// A number for each of eight elements.
struct alignas(64) EightNumbers {
  double of[8];
};

}  // namespace palpate
