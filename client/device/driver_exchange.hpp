// What the thread of a driver and the 1 kHz loop hand each other: the newest reading one way, the newest force the other, without
// locks (latest_slot.hpp).
//
// The loop stays the master of its own time (CLOCK_MONOTONIC) and the driver of its own. The other choice, to run the loop inside
// the driver's callback, saves the hand-off: a reading is then 0 to 1 driver ticks younger, and so is a force, 1 tick in the mean
// for both. It was not taken because a driver that hangs, skips or dies would take the loop with it: nobody would fade the force,
// keep the record, or tell the server and the user. As it is each side watches the other by counting its own turns, so that no
// clock is compared with another: a loop that writes nothing for `stale_turns` of the driver gets zero force, also when it
// crashed, was stopped or sits in a page fault; a driver that reads nothing for kSilentReads of the loop is `gone`.
// What it costs: a wall of stiffness K wants K T/2 of damping; one tick more makes that 3 K T/2 (Colgate and Brown 1994).
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

  /// `driver_hz`: how often turn() is called.
  explicit DriverExchange(double driver_hz) noexcept;

  /// The reading of this turn of the driver. Returns the force to render from now on [N, W]: the newest, or zero while the
  /// reading is not ok, after halt(), and when the loop has been still for kStaleAfter.
  Vec3 turn(const DeviceReading& reading) noexcept;

  DeviceReading read() noexcept;
  /// Counts as zero when it is not finite, and while the last read() was not ok.
  void write(const Vec3& force) noexcept;

  void halt() noexcept { halted_.store(true, std::memory_order_release); }
  void resume() noexcept { halted_.store(false, std::memory_order_release); }

 private:
  LatestSlot<DeviceReading> readings_;
  LatestSlot<Vec3> forces_;
  std::atomic<bool> halted_{false};
  static_assert(std::atomic<bool>::is_always_lock_free, "set from signal handlers");
  // the driver's
  const int stale_turns_;
  int still_turns_ = 0;
  Vec3 force_ = Vec3::Zero();
  // the loop's
  DeviceReading last_;
  int silent_reads_ = 0;
};

}  // namespace palpate
