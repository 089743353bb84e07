// Processor time of the calling thread: other programs on the machine do not count.
#pragma once

#include <time.h>

#include "common/base/types.hpp"

namespace palpate {

inline Micros processor_now() {
  timespec used{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return Micros{1'000'000 * std::int64_t{used.tv_sec} + used.tv_nsec / 1'000};
}

}  // namespace palpate
