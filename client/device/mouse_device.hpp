// Device `mouse`: the tool follows, smoothly at 1 kHz, a position that a window sets some sixty times a second.
//
// The tool is a critically damped mass on a spring to that position, advanced exactly over each tick (w = kPace):
//     x(t + dt) = target + (e + (v + w e) dt) exp(-w dt),   e = x - target;   v likewise
// so its velocity never jumps, whatever the window does, it never overshoots a resting target, and it trails a moving one by 2 /
// w. A mouse renders no force: the written force is returned, with the position, for the window to draw.
#pragma once

#include <atomic>

#include "client/device/device.hpp"
#include "common/base/latest_slot.hpp"

namespace palpate {

/// Force and position for the window to draw.
struct MouseFeel {
  Vec3 position = Vec3::Zero();  ///< tool point [m]
  Vec3 force = Vec3::Zero();     ///< on the tool [N]
};

class MouseDevice final : public Device {
 public:
  static constexpr double kPace = 60;  ///< [1/s]
  static constexpr double kSpeedMaxMS = 1.0;
  static constexpr Micros kClick{200'000};   ///< some frames of a server, so that viewers see it
  static constexpr double kForceMaxN = 8.5;  ///< that of a Phantom 1.5: the picture shows what a hand could feel

  explicit MouseDevice(const Vec3& at);

  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  void write(const Wrench& wrench) noexcept override;
  void stop() noexcept override { write({}); }

  /// Sets the target of the tool. One thread, not that of the haptic loop.
  void aim(const Vec3& target);
  /// Presses button 0 for kClick. Any thread.
  void click() { clicked_.store(true); }
  /// Returns the newest feel since the last call, or nullptr. Same thread as aim().
  const MouseFeel* feel() { return feels_.take(); }

 private:
  DeviceCaps caps_;
  LatestSlot<Vec3> targets_;
  LatestSlot<MouseFeel> feels_;
  Vec3 target_, position_, velocity_ = Vec3::Zero();
  Micros read_{};
  bool started_ = false;
  std::atomic<bool> clicked_{false};
  Micros pressed_until_{};
};

}  // namespace palpate
