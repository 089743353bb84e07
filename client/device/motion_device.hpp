// A device whose tool follows a recorded motion in some way: what a program needs to start it.
#pragma once

#include "client/device/device.hpp"
#include "client/device/motion_clock.hpp"

namespace palpate {

class MotionDevice : public Device {
 public:
  /// Stand at the beginning until start(). Call before the first read().
  void wait_for_start() noexcept { clock_.wait_for_start(); }
  /// The motion's time 0 on the client's clock. May be called from any thread.
  void start(Micros at) noexcept { clock_.start(at); }

 protected:
  MotionClock clock_;
};

}  // namespace palpate
