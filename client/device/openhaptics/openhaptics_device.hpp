// Device `openhaptics`: 3D Systems Touch, Touch X, Phantom Omni, Desktop and Premium through the vendor's libHD.so.
//
// The library's scheduler has a thread of its own, which exchanges the newest reading and force with the 1 kHz loop
// (driver_exchange.hpp says why the loop is not run inside it, and what that costs). When the connection breaks, a third thread
// closes the device and opens it again once a second; readings are `gone` meanwhile.
//
// One device in a process: the library's own wrappers know no more on Linux. A driver that hangs cannot be closed: the third
// thread is then left to itself when this device is destroyed, and closes it when the driver goes on.
#pragma once

#include <memory>
#include <string>

#include "client/device/device.hpp"

namespace palpate {

class OpenHapticsDevice final : public Device {
 public:
  /// `config`: as the vendor's setup program names the device; empty: the default one. Throws InputError when the library or the
  /// device is not there, or the device is open already.
  explicit OpenHapticsDevice(const std::string& config = "");
  ~OpenHapticsDevice() override;
  OpenHapticsDevice(const OpenHapticsDevice&) = delete;
  OpenHapticsDevice& operator=(const OpenHapticsDevice&) = delete;

  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  void write(const Vec3& force) noexcept override;
  void stop() noexcept override;
  void halt() noexcept override;
  void resume() noexcept override;

 private:
  struct Keeper;
  std::shared_ptr<Keeper> keeper_;
  DeviceCaps caps_;
};

}  // namespace palpate
