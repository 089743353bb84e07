// The edge of a grid over a body's nodes that has no more cells than wanted.
#pragma once

#include <cstddef>

namespace palpate {

/// The smallest edge [m], to 1/256 of a factor of two, with which `cells(edge)` are no more than `most`; `from_m` has more, or
/// will do.
template <typename Cells>
double smallest_edge(double from_m, std::size_t most, const Cells& cells) {
  double many = from_m, few = many;
  while (cells(few) > most) few *= 2;
  for (int k = 0; k < 8; ++k) {
    const double edge = 0.5 * (many + few);
    (cells(edge) > most ? many : few) = edge;
  }
  return few;
}

}  // namespace palpate
