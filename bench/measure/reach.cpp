#include "bench/measure/reach.hpp"

#include <algorithm>

namespace palpate {

double reach(std::vector<ErrorAt> sweep, double limit) {
  std::sort(sweep.begin(), sweep.end(), [](const ErrorAt& a, const ErrorAt& b) { return a.at < b.at; });
  double until = -1;
  for (const ErrorAt& p : sweep) {
    if (!(p.error < limit)) break;
    until = p.at;
  }
  return until;
}

}  // namespace palpate
