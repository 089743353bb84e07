#include "bench/measure/reach.hpp"

#include <algorithm>

namespace palpate {

double reach(std::vector<SweepPoint> sweep, double limit) {
  std::sort(sweep.begin(), sweep.end(), [](const SweepPoint& a, const SweepPoint& b) { return a.at < b.at; });
  double until = -1;
  for (const SweepPoint& p : sweep) {
    if (!(p.error < limit)) break;
    until = p.at;
  }
  return until;
}

}  // namespace palpate
