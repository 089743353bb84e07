// Exchange between a driver's thread and the 1 kHz loop: the newest reading one way, the newest force the other, without locks
// (latest_slot.hpp).
//
// The loop keeps its own time (CLOCK_MONOTONIC) and the driver its own. The alternative, to run the loop inside the driver's
// callback, saves the hand-off: a reading is then 0 to 1 driver ticks younger, and so is a force, 1 tick in the mean for both
// together. It was rejected because a driver that hangs, skips or dies would stop the loop with it: nothing would fade the force,
// keep the record, or inform the server and the user. Instead each side watches the other by counting its own turns, so that no
// two clocks are compared: a loop that writes nothing for `stale_turns` of the driver gets zero force, also after a crash, a stop
// or a page fault; a driver that delivers nothing for kSilentReads of the loop counts as `gone`. The cost: a wall of stiffness K
// needs K T/2 of damping; one more tick makes that 3 K T/2 (Colgate and Brown 1994).
//
// turn() belongs to the driver's thread, read() and write() to the loop's, halt() and resume() to any. None allocates or locks.
#pragma once

#include <atomic>

#include "client/device/device.hpp"
#include "common/base/latest_slot.hpp"

namespace palpate {

class DriverExchange {
 public:
  static constexpr int kSilentReads = 20;
  static constexpr Micros kStaleAfter{20'000};

  /// `driver_hz`: rate of turn().
  explicit DriverExchange(double driver_hz) noexcept;

  /// Passes on the reading of this turn of the driver. Returns the wrench to render from now on: the newest, or zero while the
  /// reading is not ok, after halt(), and when the loop has not written for kStaleAfter.
  Wrench turn(const DeviceReading& reading) noexcept;

  DeviceReading read() noexcept;
  /// A part that is not finite counts as zero, and all of it while the last read() was not ok.
  void write(const Wrench& wrench) noexcept;

  void halt() noexcept { halted_.store(true, std::memory_order_release); }
  void resume() noexcept { halted_.store(false, std::memory_order_release); }

 private:
  LatestSlot<DeviceReading> readings_;
  LatestSlot<Wrench> forces_;
  std::atomic<bool> halted_{false};
  static_assert(std::atomic<bool>::is_always_lock_free, "set from signal handlers");
  // state of the driver's thread
  const int stale_turns_;
  int still_turns_ = 0;
  Wrench force_;
  // state of the loop's thread
  DeviceReading last_;
  int silent_reads_ = 0;
};

}  // namespace palpate
