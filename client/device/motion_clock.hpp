// The start of a recorded motion on the client's clock. By default this is the first reading; after wait_for_start() the motion
// stands at its beginning until start() sets the moment. start() may be called from another thread; everything else belongs to
// the reader.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>

#include "common/base/types.hpp"

namespace palpate {

class MotionClock {
 public:
  void wait_for_start() noexcept { begin_us_.store(kWaiting, std::memory_order_release); }
  void start(Micros at) noexcept { begin_us_.store(at.count(), std::memory_order_release); }

  bool started(Micros now) const noexcept { return elapsed_or_negative(now) >= 0; }

  /// Returns the time since the start, zero before it.
  Micros elapsed(Micros now) noexcept {
    if (begin_us_.load(std::memory_order_acquire) == kFirstReading) start(now);
    return Micros{std::max<std::int64_t>(0, elapsed_or_negative(now))};
  }

 private:
  static constexpr std::int64_t kFirstReading = std::numeric_limits<std::int64_t>::min();
  static constexpr std::int64_t kWaiting = std::numeric_limits<std::int64_t>::max();

  std::int64_t elapsed_or_negative(Micros now) const noexcept {
    const std::int64_t begin = begin_us_.load(std::memory_order_acquire);
    return begin == kFirstReading || begin == kWaiting ? -1 : now.count() - begin;
  }

  std::atomic<std::int64_t> begin_us_{kFirstReading};
};

}  // namespace palpate
