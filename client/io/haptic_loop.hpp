// The 1 kHz loop of a real device, on a thread of its own.
//
// Tick n is due at t_0 + n ms of CLOCK_MONOTONIC (the client's clock, common/io/monotonic.hpp). The thread sleeps until then
// (absolute time, so that lateness never adds up), reads the device, runs the displays and writes the force of the main one. A
// tick that is due before the one in hand is done is skipped, never made up for by running two in a row.
//
// Displays after the first are comparisons on the same hand: they get the same samples, their force is only recorded.
// Ways out: stop(), or a device that is gone or at its end. On all of them the force first goes to zero over kRampTicks (a device
// that is gone cannot be written to), then Device::stop() is called.
//
// Inside the loop nothing is allocated, locked, logged or thrown.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "client/core/haptic_tick.hpp"
#include "client/device/device.hpp"
#include "client/io/histogram.hpp"
#include "client/io/realtime.hpp"
#include "client/io/recorder.hpp"

namespace palpate {

struct HapticLoopOptions {
  bool realtime = true;          ///< ask the operating system for it
  std::size_t record_ticks = 0;  ///< rows of the recorder's ring: how far its reader may fall behind; 0: nobody reads it
};

/// Written by the loop, to be read after it has ended.
struct HapticLoopStats {
  std::uint64_t ticks = 0;
  std::uint64_t late = 0, very_late = 0;  ///< woken more than 200 us, more than 1 ms after they were due
  std::uint64_t skipped = 0;              ///< ticks that never ran
  double force_max_n = 0;
  bool device_ended = false;
  Histogram<10'000> late_us{1};    ///< from due to awake
  Histogram<10'000> tick_ns{20};   ///< HapticTick::tick of the main display
  Histogram<10'000> work_ns{200};  ///< the whole tick: device, all displays, recorder
};

class HapticLoop {
 public:
  static constexpr int kRampTicks = 20;

  /// `displays` is not empty; the first one is felt. Everything outlives the loop.
  HapticLoop(Device& device, std::vector<HapticTick*> displays, const HapticLoopOptions& options);
  ~HapticLoop();
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  /// Starts the thread and returns once it runs; what real-time properties it got.
  RealtimeStatus start();
  /// Makes the device safe and ends the thread. Harmless when it has ended.
  void stop();

  /// A moment at which a tick is due, the first one at least `after` from now: where to start a motion. While the loop runs. Any
  /// thread.
  Micros due_after(Micros after) const noexcept;
  bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  /// How many displays have a patch, 0 while the felt one has none. Any thread.
  int displays_with_patch() const noexcept { return with_patch_.load(std::memory_order_acquire); }
  /// After stop().
  const HapticLoopStats& stats() const { return stats_; }
  /// Every tick, for one reader; any time.
  Recorder& recorder() { return recorder_; }

 private:
  void run() noexcept;
  bool tick(Micros due) noexcept;
  void record(Micros due, const DeviceReading& reading, const TickOutput& main) noexcept;
  Orientation orientation_of(const DeviceReading& reading) const noexcept;
  void make_safe(Micros due) noexcept;

  Device& device_;
  std::vector<HapticTick*> displays_;
  std::vector<TickOutput> outputs_;
  HapticLoopOptions options_;
  Recorder recorder_;
  HapticLoopStats stats_;
  RealtimeStatus realtime_;
  Vec3 force_ = Vec3::Zero();
  std::atomic<std::int64_t> first_due_us_{0};
  std::atomic<int> with_patch_{0};
  std::atomic<bool> stop_{false}, running_{false}, ready_{false};
  std::thread thread_;
};

}  // namespace palpate
