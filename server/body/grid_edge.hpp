// Cell size of the finest grid over a body's nodes that has at most a given number of cells.
#pragma once

#include <cstddef>

namespace palpate {

/// Returns the smallest edge [m], to 1/256 of a factor of two, for which `cells(edge)` is at most `most`; `from_m` is a lower
/// bound.
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
