// A device whose tool follows a recorded motion: the interface to start it.
#pragma once

#include "client/device/device.hpp"
#include "client/device/motion_clock.hpp"

namespace palpate {

class MotionDevice : public Device {
 public:
  /// Holds the tool at the beginning of the motion until start(). Call before the first read().
  void wait_for_start() noexcept { clock_.wait_for_start(); }
  /// Sets the motion's time 0 on the client's clock. May be called from any thread.
  void start(Micros at) noexcept { clock_.start(at); }

 protected:
  MotionClock clock_;
};

}  // namespace palpate
