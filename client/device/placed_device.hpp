// A device that a hand holds, put where the body is: from start() on the tool is at `home` plus what the hand has moved since.
//
//     p_W = home + (p - p_start),       p the adapter's reading, already in W's axes
//
// Before start() the tool stands at home and the hand feels nothing, wherever it moves. After it, and whenever the device is ok
// again after it was not, the force grows from nothing over kRiseTicks writes, so that there is no step.
#pragma once

#include <memory>

#include "client/device/motion_device.hpp"

namespace palpate {

class PlacedDevice final : public MotionDevice {
 public:
  static constexpr int kRiseTicks = 50;

  /// Waits for start().
  PlacedDevice(std::unique_ptr<Device> device, const Vec3& home);

  /// Of the device, with a workspace in W that holds wherever in its own it starts: home plus every way from one end to the
  /// other.
  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  void write(const Vec3& force) noexcept override;
  void stop() noexcept override { device_->stop(); }
  void halt() noexcept override { device_->halt(); }
  void resume() noexcept override;

 private:
  std::unique_ptr<Device> device_;
  DeviceCaps caps_;
  Vec3 home_, start_ = Vec3::Zero();
  bool placed_ = false;
  int risen_ = 0;
};

}  // namespace palpate
