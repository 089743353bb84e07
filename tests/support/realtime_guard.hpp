// Proof that a stretch of code suits a real-time thread: counts what the calling thread allocates, frees, locks and throws.
//
//     RealtimeGuard guard;   // from here on this thread is watched
//     ... the 1 kHz tick ...
//     const auto seen = guard.end();
//     CHECK(seen.none());
//
// The program that links this file has its malloc family, pthread_mutex_lock and __cxa_throw replaced by counting ones that
// forward to the C library. Sanitizers replace the same functions, so under them nothing is counted: see active().
#pragma once

#include <cstdint>

namespace palpate::test {

struct RealtimeFaults {
  std::uint64_t allocations = 0, frees = 0, locks = 0, throws = 0;
  bool none() const { return allocations + frees + locks + throws == 0; }
};

class RealtimeGuard {
 public:
  RealtimeGuard();
  ~RealtimeGuard();
  RealtimeGuard(const RealtimeGuard&) = delete;
  RealtimeGuard& operator=(const RealtimeGuard&) = delete;
  /// Stops watching; returns the counts since construction.
  RealtimeFaults end();
  /// Returns true if this build counts at all.
  static bool active();
};

}  // namespace palpate::test
