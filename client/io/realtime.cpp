#include "client/io/realtime.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

namespace palpate {

namespace {
// Above ordinary programs, below the kernel's own threads (threaded interrupts run at 50).
constexpr int kPriority = 49;
}  // namespace

RealtimeStatus request_realtime(int above) noexcept {
  RealtimeStatus status;
  status.asked = true;
  sched_param parameters{};
  parameters.sched_priority = kPriority + above;
  status.priority = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
  status.memory_locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  status.precise_timers = prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL) == 0;
  return status;
}

ThreadSetup realtime_setup(bool wanted) noexcept {
  return wanted ? +[] { request_realtime(); } : nullptr;
}

std::string describe(const RealtimeStatus& status) {
  if (!status.asked) return "real time: off";
  if (status.granted()) return "real time: granted";
  std::string denied;
  const auto add = [&denied](bool granted, const char* what) {
    if (!granted) denied += (denied.empty() ? "" : ", ") + std::string(what);
  };
  add(status.priority, "priority (ulimit -r)");
  add(status.memory_locked, "locked memory (ulimit -l)");
  add(status.precise_timers, "precise timers");
  return "real time: denied " + denied + "; ticks may be late (--realtime off to run so without this line)";
}

}  // namespace palpate
