// Switches the force off when the loop's ticks stop: a thread of its own that does not depend on the loop, the network or the
// disk. It looks every kLookEvery; when the last tick is older than kMost it calls Device::halt(), after which the device shows
// zero whatever is written, until the loop ticks again and calls resumes(). So the force is gone kMost + kLookEvery after the
// last tick, 17 ms, if the operating system runs a real-time thread on time. When its own look was late by more than kMost, the
// program was stopped or the machine stood still: the loop then has kMost from there.
//
// No protection against a process that is killed or stopped as a whole: the device's own watchdog is (DeviceCaps::watchdog).
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "client/device/device.hpp"

namespace palpate {

class Watchdog {
 public:
  static constexpr Micros kMost{15'000}, kLookEvery{2'000};

  explicit Watchdog(Device& device) : device_(device) {}
  ~Watchdog() { stop(); }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// Starts the thread, which watches from the first tick on.
  void start(bool realtime);
  /// Ends the thread and leaves the device unchanged.
  void stop();

  // called by the loop; neither waits
  void tick(Micros now) noexcept { ticked_us_.store(now.count(), std::memory_order_release); }
  /// Notes that there are no more ticks.
  void rest() noexcept { ticked_us_.store(0, std::memory_order_release); }
  /// True when forces may be written. After the force was switched off: returns false at least once, then calls Device::resume();
  /// the next force has to begin at zero, which `began_again` reports.
  bool resumes(bool& began_again) noexcept;

  /// Number of times that it switched the force off. Any thread.
  std::uint32_t halts() const noexcept { return halts_.load(std::memory_order_relaxed); }

 private:
  enum class State : std::uint8_t { watching, halting, halted };

  void run() noexcept;

  Device& device_;
  std::atomic<State> state_{State::watching};
  std::atomic<std::int64_t> ticked_us_{0};
  std::atomic<std::uint32_t> halts_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace palpate
