// How signals end a program that holds a device: never without taking the force away.
//
//     HUP INT QUIT TERM USR1 USR2 ALRM VTALRM PROF XCPU PWR IO: a flag is set, and the program ends by itself: ramp, recording,
//         report. So do ABRT, SEGV, BUS, ILL, FPE, SYS and TRAP where another process sent them. HUP stays ignored where it was
//         (nohup).
//     PIPE, XFSZ: ignored, so that who writes gets an error.
//     ABRT, SEGV, BUS, ILL, FPE, SYS, TRAP of the program's own, so also abort(), std::terminate and an exception that nobody
//     caught:
//         every CrashStop is called on the thread that fell, then the signal does what it does by default.
//     KILL, STOP and a machine that stands still: nothing here can help; the device's own watchdog does (DeviceCaps::watchdog).
//
// Handlers call nothing but what POSIX allows in them.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>

namespace palpate {

/// Once, before other threads. `stop` outlives the program's threads.
void end_by_signals(std::atomic<bool>& stop);

/// The calling thread is not interrupted by signals other than those of its own faults.
void block_signals() noexcept;

/// What has to be done before the program falls. Registered while it lives, 16 at most.
class CrashStop {
 public:
  CrashStop() = default;
  virtual ~CrashStop();
  CrashStop(const CrashStop&) = delete;
  CrashStop& operator=(const CrashStop&) = delete;
  /// In a signal handler, on any thread: no lock, no memory. May wait for a few tens of milliseconds.
  virtual void stop_in_crash() noexcept = 0;

 protected:
  /// From the derived constructor's end to its destructor's begin.
  void watch_crashes();
  void forget_crashes() noexcept;
};

/// A stack for handlers of the calling thread, whose own may have overflown. Lives on that thread.
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
