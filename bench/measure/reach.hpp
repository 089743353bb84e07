// Range of a sweep over which an error stays small.
#pragma once

#include <vector>

namespace palpate {

struct ErrorAt {
  double at = 0, error = 0;
};

/// Largest `at` for which its error and those of all smaller ones are below `limit`, without interpolation. -1 if the smallest
/// exceeds it already, or the sweep is empty; values of `at` are never negative.
double reach(std::vector<ErrorAt> sweep, double limit);

}  // namespace palpate
