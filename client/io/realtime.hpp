// What a 1 kHz thread asks of the operating system: a place in front of other programs, memory that is not paged out, and
// timers that are not rounded. Each may be denied; what was granted is said, never assumed.
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

/// For the calling thread (memory: the whole process), `above` steps in front of other 1 kHz threads. Does not throw; call before
/// the loop, it may take milliseconds.
RealtimeStatus request_realtime(int above = 0) noexcept;

/// What threads of a device call first: request_realtime(), or nothing (null) where it is not wanted.
using ThreadSetup = void (*)();
ThreadSetup realtime_setup(bool wanted) noexcept;

/// One line for a person: what was denied and what to do about it; "real time: granted" or "real time: off".
std::string describe(const RealtimeStatus& status);

}  // namespace palpate
