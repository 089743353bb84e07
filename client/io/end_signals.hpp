// Termination of a program that holds a device, by signals: never without switching the force off.
//
//     HUP INT QUIT TERM USR1 USR2 ALRM VTALRM PROF XCPU PWR IO: a flag is set, and the program ends by itself: ramp, recording,
//         report. The same for ABRT, SEGV, BUS, ILL, FPE, SYS and TRAP from another process. HUP stays ignored where it was
//         (nohup).
//     PIPE, XFSZ: ignored, so that the writer gets an error.
//     ABRT, SEGV, BUS, ILL, FPE, SYS, TRAP raised by the program itself, including abort(), std::terminate and an uncaught
//         exception: every CrashStop is called on the thread that crashed, then the signal has its default effect.
//     KILL, STOP and a machine that stands still: only the device's own watchdog helps (DeviceCaps::watchdog).
//
// Handlers call only functions that POSIX allows in them.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace palpate {

/// Installs the handlers. Call once, before other threads start. `stop` outlives the program's threads.
void end_by_signals(std::atomic<bool>& stop);

/// Blocks all signals of the calling thread but those of its own faults.
void block_signals() noexcept;

/// An action before the program crashes. Registered during its lifetime, kMost at a time.
class CrashStop {
 public:
  static constexpr std::size_t kMost = 16;
  CrashStop() = default;
  virtual ~CrashStop();
  CrashStop(const CrashStop&) = delete;
  CrashStop& operator=(const CrashStop&) = delete;
  /// Called in a signal handler, on any thread: no lock, no memory. May wait for a few tens of milliseconds.
  virtual void stop_in_crash() noexcept = 0;

 protected:
  /// Register and unregister: at the end of the derived constructor, and at the beginning of its destructor.
  void watch_crashes();
  void forget_crashes() noexcept;
};

/// A stack for signal handlers of the calling thread, whose own may have overflowed. Lives on that thread.
class CrashStack {
 public:
  CrashStack() noexcept;
  ~CrashStack();
  CrashStack(const CrashStack&) = delete;
  CrashStack& operator=(const CrashStack&) = delete;

 private:
  static constexpr std::size_t kBytes = 64 * 1024;
  alignas(16) std::array<std::byte, kBytes> bytes_;
};

}  // namespace palpate
