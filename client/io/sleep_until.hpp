// Sleeps until an absolute moment of the client's clock, CLOCK_MONOTONIC.
#pragma once

#include <time.h>

#include "common/base/types.hpp"

namespace palpate {

inline void sleep_until(Micros moment) noexcept {
  constexpr std::int64_t kNanosPerMicro = 1000, kNanosPerSecond = 1'000'000'000;
  const std::int64_t ns = moment.count() * kNanosPerMicro;
  const timespec t{ns / kNanosPerSecond, ns % kNanosPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
  }
}

}  // namespace palpate
