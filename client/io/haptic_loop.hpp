// The 1 kHz loop of a real device, on a thread of its own.
//
// Tick n is due at t_0 + n ms of CLOCK_MONOTONIC (the client's clock, common/io/monotonic.hpp). The thread sleeps until then
// (absolute time, so that lateness never accumulates), reads the device, runs the displays and writes the force of the main one.
// A tick that is due before the current one is done is skipped; two are never run in a row to make up.
//
// Displays after the first are comparisons on the same hand: they receive the same samples, and their force is only recorded. All
// are limited to the capabilities of the device (device_limits.hpp), which a device that renders a force must report.
//
// The force, and with it the torque, is zero, whatever the displays request, while
//     the device is not ok (not ready, at fault, gone): its readings are ignored and nothing is written, until it is ok again
//     its positions are not plausible (reading_check.hpp): at once after a jump, otherwise faded over kRampTicks
//     hold(true): faded over kRampTicks
//     ticks stopped for longer than the watchdog waits (watchdog.hpp)
// After each of these, and after a gap of more than Guard::kGapMaxS, the force begins at zero (HapticTick::restart). A force that
// the device still holds from before a gap or a jump, without a watchdog of its own that was due, is added and goes to zero over
// kRampTicks.
//
// The loop ends by stop(), or at the end of a motion. In both cases the force first goes to zero over kRampTicks (but not at the
// end of a motion), then Device::stop() is called. A device that does not return from a call within kStopMost is halted and
// abandoned: then stuck() is true, and the program should end without waiting for it. A program that crashes (end_signals.hpp)
// ramps and stops too, from the signal handler, or halts the device where the loop's own thread crashed.
//
// Inside the loop nothing allocates, locks, logs or throws.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>
#include <vector>

#include "client/core/haptic_tick.hpp"
#include "client/device/device.hpp"
#include "client/io/end_signals.hpp"
#include "client/io/histogram.hpp"
#include "client/io/reading_check.hpp"
#include "client/io/realtime.hpp"
#include "client/io/recorder.hpp"
#include "client/io/watchdog.hpp"
#include "common/base/latest_slot.hpp"

namespace palpate {

struct HapticLoopOptions {
  bool realtime = true;          ///< true: request real time from the operating system
  std::size_t record_ticks = 0;  ///< rows of the recorder's ring: the lag that its reader may have; 0: there is no reader
  PassivityMode passivity = PassivityMode::on;
};

/// Written by the loop, readable after it has ended.
struct HapticLoopStats {
  std::uint64_t ticks = 0;
  std::uint64_t late = 0, very_late = 0;                       ///< ticks that woke more than 200 us, more than 1 ms late
  std::uint64_t skipped = 0;                                   ///< ticks that never ran
  std::uint64_t away = 0;                                      ///< ticks in which the device was not ok
  std::uint64_t not_believed = 0;                              ///< ticks with an implausible position
  std::uint64_t halts = 0;                                     ///< times that the watchdog switched the force off
  double force_max_n = 0, torque_max_nm = 0, grip_max_nm = 0;  ///< the last of the patch, not rendered
  bool device_ended = false;
  Histogram<10'000> late_us{1};    ///< delay from due to awake
  Histogram<10'000> tick_ns{20};   ///< HapticTick::tick of the main display
  Histogram<10'000> work_ns{200};  ///< the complete tick: device, all displays, recorder
};

/// State of the device, for a person.
struct DeviceNote {
  DeviceState state = DeviceState::ok;
  DeviceReason reason;  ///< why it is not ok, or why its positions are implausible: then the state is `fault`
};

class HapticLoop final : private CrashStop {
 public:
  static constexpr int kRampTicks = 20;
  static constexpr Micros kStopMost{500'000};

  /// `displays` is not empty; the first one is felt. All arguments outlive the loop. Throws InputError when the device renders a
  /// force but does not report its limits.
  HapticLoop(Device& device, std::vector<HapticTick*> displays, const HapticLoopOptions& options);
  ~HapticLoop() override;

  /// Starts the thread and returns, once it runs, the real-time properties that were granted.
  RealtimeStatus start();
  /// Makes the device safe and ends the thread. No effect when it has ended.
  void stop();
  /// After stop(): true when the thread hangs in the device, which was halted. Destroying the loop waits for it.
  bool stuck() const noexcept { return stuck_; }
  /// Fades the force to zero and keeps it there, or fades it in again. Any thread.
  void hold(bool on) noexcept { hold_.store(on, std::memory_order_relaxed); }
  /// True when the force written last is zero. Any thread.
  bool at_zero() const noexcept { return at_zero_.load(std::memory_order_acquire); }

  /// Returns a moment at which a tick is due, the first one at least `after` from now, as the start of a motion. While the loop
  /// runs. Any thread.
  Micros due_after(Micros after) const noexcept;
  bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  /// Number of displays with a patch, 0 while the felt one has none. Any thread.
  int displays_with_patch() const noexcept { return with_patch_.load(std::memory_order_acquire); }
  /// Returns the newest change since the last call, or nullptr. One thread.
  const DeviceNote* changed() { return notes_.take(); }
  /// Number of times that the watchdog switched the force off. Any thread.
  std::uint32_t halts() const noexcept { return watchdog_.halts(); }
  /// Statistics, valid after stop().
  const HapticLoopStats& stats() const { return stats_; }
  /// Rows of every tick, for one reader; at any time.
  Recorder& recorder() { return recorder_; }

 private:
  void run() noexcept;
  void loop() noexcept;
  bool tick(Micros due) noexcept;
  void stay_away(const DeviceReading& reading) noexcept;
  Wrench faded(const Wrench& wrench, bool shown) noexcept;
  void begin_again(bool holds) noexcept;
  Wrench left_over() noexcept;
  void write(const Wrench& wrench) noexcept;
  void note(DeviceState state, const DeviceReason& reason) noexcept;
  void record(Micros due, const DeviceReading& reading, const TickOutput& main) noexcept;
  Orientation orientation_of(const DeviceReading& reading) const noexcept;
  void make_safe(Micros due) noexcept;
  void stop_in_crash() noexcept override;

  Device& device_;
  std::vector<HapticTick*> displays_;
  std::vector<TickOutput> outputs_;
  HapticLoopOptions options_;
  Recorder recorder_;
  ReadingCheck check_;
  HapticLoopStats stats_;
  RealtimeStatus realtime_;
  Wrench wrench_;     ///< written last
  double share_ = 1;  ///< scale of it, below 1 while it fades
  Wrench held_;       ///< what the device was left with; part of it remains for held_ticks_ more ticks
  int held_ticks_ = 0;
  Micros last_due_{};
  bool was_away_ = false;  ///< true: the device was not ok in the last tick
  DeviceNote noted_;
  LatestSlot<DeviceNote> notes_;
  Watchdog watchdog_;
  std::atomic<std::int64_t> first_due_us_{0};
  std::atomic<int> with_patch_{0}, thread_id_{0};
  std::atomic<bool> stop_{false}, running_{false}, ready_{false}, hold_{false}, at_zero_{true};
  bool stuck_ = false;
  std::thread thread_;
};

}  // namespace palpate
