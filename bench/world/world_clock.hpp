// One participant's clock against world time t:
//
//     c(t) = t + offset + drift t + the steps so far,      in whole microseconds
//
// A quartz drifts by tens of ppm; a clock steps ahead when its virtual machine was moved. A clock that stood still while its
// machine slept is stepped back by as much on waking: nobody read it meanwhile, so to its readers it simply continues.
#pragma once

#include <cmath>

#include "common/base/types.hpp"

namespace palpate {

class WorldClock {
 public:
  explicit WorldClock(Micros offset, double drift_ppm = 0)
      : offset_(offset), drift_per_1e9_(static_cast<std::int64_t>(std::llround(drift_ppm * 1e3))) {}

  Micros at(Micros t) const { return t + offset_ + Micros{t.count() * drift_per_1e9_ / 1'000'000'000}; }
  /// First moment at which the clock reads `own` or more.
  Micros world(Micros own) const {
    const auto elapsed = static_cast<double>((own - offset_).count());
    Micros t{static_cast<std::int64_t>(elapsed / (1 + static_cast<double>(drift_per_1e9_) * 1e-9))};
    while (at(t) < own) ++t;
    while (at(t - Micros{1}) >= own) --t;
    return t;
  }
  /// Advances the reading by `by` from now on.
  void step(Micros by) { offset_ += by; }

 private:
  Micros offset_;
  std::int64_t drift_per_1e9_;
};

}  // namespace palpate
