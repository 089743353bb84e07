// Device `replay`: the tool follows the recording, whatever force is written. After the motion its readings are `ended`, or the
// tool stays at its end.
#pragma once

#include "client/device/motion_device.hpp"
#include "common/motion/motion.hpp"

namespace palpate {

class ReplayDevice final : public MotionDevice {
 public:
  enum class AtEnd : bool { gone, stays };
  explicit ReplayDevice(Motion motion, AtEnd at_end = AtEnd::gone);

  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  void write(const Wrench& wrench) noexcept override { wrench_ = wrench; }
  void stop() noexcept override { wrench_ = {}; }

  /// Force last written [N].
  const Vec3& force() const noexcept { return wrench_.force; }

 private:
  Motion motion_;
  AtEnd at_end_;
  DeviceCaps caps_;
  Wrench wrench_;
};

}  // namespace palpate
