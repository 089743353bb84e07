// Which of several points no other beats in both of two measures.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

struct CostAndError {
  double cost = 0, error = 0;
};

/// Indices of the points than which none is as cheap and truer, or cheaper and as true; by ascending cost, errors falling. Of
/// points that are alike the first.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> points);

}  // namespace palpate
