// Takes the force away when the loop's ticks stop: a thread of its own that nothing of the loop, the network or the disk can hold
// up. It looks every kLookEvery; when the last tick is older than kMost it calls Device::halt(), from which the device shows zero
// whatever is written, until the loop, ticking again, has called resumes(). So the force is gone kMost + kLookEvery after the
// last tick, 17 ms, where the operating system lets a thread of real-time priority run when it is due. Where its own look came
// late by more than kMost, the program was stopped or the machine stood still: the loop then has kMost from there.
//
// No help against a process that is killed or stopped whole: that is for the device's own watchdog (DeviceCaps::watchdog).
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

  /// Watches from the first tick on.
  void start(bool realtime);
  /// Ends the thread. The device is as it was.
  void stop();

  // The loop, neither of which waits:
  void tick(Micros now) noexcept { ticked_us_.store(now.count(), std::memory_order_release); }
  /// There will be no more ticks.
  void rest() noexcept { ticked_us_.store(0, std::memory_order_release); }
  /// Whether forces may be written. After the force was taken away: false once or more, then Device::resume() is called and the
  /// next force has to begin at zero, which `began_again` says.
  bool resumes(bool& began_again) noexcept;

  /// How often it took the force away. Any thread.
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
