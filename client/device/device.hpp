// A haptic device as the 1 kHz loop sees it: read where the tool is, write the force that the hand shall feel.
// Calls come from one thread. read and write do not allocate, lock or throw; a device that vanishes says so in `ok`.
#pragma once

#include <string>

#include "common/base/types.hpp"

namespace palpate {

struct DeviceCaps {
  std::string name;
  double force_max_n = 0;        ///< peak force it can render, 0 = not limited
  double slew_max_n_s = 0;       ///< largest change of force, 0 = not limited
  double stiffness_max_n_m = 0;  ///< stable rendering limit, 0 = not limited
};

struct DeviceReading {
  Vec3 position = Vec3::Zero();  ///< tool point in frame W [m]
  bool ok = false;               ///< false: the device is gone or the motion has ended
};

class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceCaps& caps() const = 0;
  /// `now` is the client's monotonic clock; simulated devices advance their own dynamics to it.
  virtual DeviceReading read(Micros now) noexcept = 0;
  /// Force on the tool [N] from now on.
  virtual void write(const Vec3& force) noexcept = 0;
  /// Makes the device safe: zero force. Called on every way out.
  virtual void stop() noexcept = 0;
};

}  // namespace palpate
