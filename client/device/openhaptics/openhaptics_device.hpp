// Device `openhaptics`: 3D Systems Touch, Touch X, Phantom Omni, Desktop and Premium through the vendor's libHD.so.
//
// The library's scheduler has a thread of its own, which exchanges the newest reading and force with the 1 kHz loop
// (driver_exchange.hpp explains why the loop does not run inside it, and what that costs). When the connection breaks, a third
// thread closes the device and reopens it once a second; readings are `gone` meanwhile.
//
// One device in a process, like the library's own wrappers on Linux. A driver that hangs cannot be closed: when this device is
// destroyed, the third thread is abandoned and closes it once the driver continues.
#pragma once

#include <memory>
#include <string>

#include "client/device/device.hpp"

namespace palpate {

class OpenHapticsDevice final : public Device {
 public:
  /// `config`: the device's name in the vendor's setup program; empty: the default device. Throws InputError when the library or
  /// the device is missing, or the device is open already.
  explicit OpenHapticsDevice(const std::string& config = "");
  ~OpenHapticsDevice() override;
  OpenHapticsDevice(const OpenHapticsDevice&) = delete;
  OpenHapticsDevice& operator=(const OpenHapticsDevice&) = delete;

  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  void write(const Wrench& wrench) noexcept override;
  void stop() noexcept override;
  void halt() noexcept override;
  void resume() noexcept override;

 private:
  struct Keeper;
  std::shared_ptr<Keeper> keeper_;
  DeviceCaps caps_;
};

}  // namespace palpate
