// Finds the points that no other point beats in both of two measures.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

struct CostAndError {
  double cost = 0, error = 0;
};

/// Indices of the points for which no other is at most as expensive and more accurate, or cheaper and as accurate; costs ascend,
/// errors fall. Of equal points the first is returned.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> points);

}  // namespace palpate
