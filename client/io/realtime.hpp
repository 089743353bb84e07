// Real-time properties that a 1 kHz thread requests from the operating system: priority over other programs, memory that is not
// paged out, and timers that are not rounded. Each may be denied; what was granted is reported, never assumed.
#pragma once

#include <string>

namespace palpate {

struct RealtimeStatus {
  bool asked = false;           ///< false: --realtime off
  bool priority = false;        ///< SCHED_FIFO
  bool memory_locked = false;   ///< mlockall
  bool precise_timers = false;  ///< timer slack of 1 ns
  bool granted() const { return priority && memory_locked && precise_timers; }
};

/// Requests them for the calling thread (memory: the whole process), `above` priority steps over other 1 kHz threads. Does not
/// throw; call before the loop, because it may take milliseconds.
RealtimeStatus request_realtime(int above = 0) noexcept;

/// First call of a device's threads: request_realtime(), or nothing (null) where real time is not wanted.
using ThreadSetup = void (*)();
ThreadSetup realtime_setup(bool wanted) noexcept;

/// Returns a line for a person: what was denied and the remedy; "real time: granted" or "real time: off".
std::string describe(const RealtimeStatus& status);

}  // namespace palpate
