// Device `forcedimension`: omega, delta, sigma, lambda, and a Falcon, through Force Dimension's libdrd.so or libdhd.so.
//
// The library has no thread of its own for this: one of our threads calls it kTurnHz times a second and exchanges the newest
// reading and force with the 1 kHz loop (driver_exchange.hpp), so that a call that waits for the USB does not delay the loop.
// That thread also homes the device, which then moves by itself, and reopens it once a second after the connection broke. Several
// devices may be open at once. A call that hangs cannot be aborted: when the device object is destroyed, the thread is abandoned
// and closes its device when the call returns.
#pragma once

#include <memory>

#include "client/device/device.hpp"

namespace palpate {

struct ForceDimensionOptions {
  int index = 0;                ///< index among the devices that the library sees, the first is 0
  Micros hands_off{3'000'000};  ///< time from the warning that the device will move by itself until it does
  bool own_thread = true;       ///< false, for tests: the caller calls turn(), and the device is never homed or reopened
};

class ForceDimensionDevice final : public Device {
 public:
  /// Throws InputError when the library or the device is missing, or the device is open already.
  explicit ForceDimensionDevice(const ForceDimensionOptions& options = {});
  ~ForceDimensionDevice() override;
  ForceDimensionDevice(const ForceDimensionDevice&) = delete;
  ForceDimensionDevice& operator=(const ForceDimensionDevice&) = delete;

  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  void write(const Wrench& wrench) noexcept override;
  void stop() noexcept override;
  void halt() noexcept override;
  void resume() noexcept override;

  void turn() noexcept;

 private:
  struct Driver;
  std::shared_ptr<Driver> driver_;
  DeviceCaps caps_;
};

}  // namespace palpate
