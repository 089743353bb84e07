// How far along a sweep an error stays small.
#pragma once

#include <vector>

namespace palpate {

struct ErrorAt {
  double at = 0, error = 0;
};

/// The largest `at` whose error, and that of every smaller one, is below `limit`; nothing is guessed between the points. -1 when
/// that is not so of the smallest (and for none): sweeps are over what cannot be negative.
double reach(std::vector<ErrorAt> sweep, double limit);

}  // namespace palpate
