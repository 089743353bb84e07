// Device `openhaptics`: 3D Systems Touch, Touch X, Phantom Omni, Desktop and Premium through the vendor's libHD.so.
//
// The library's scheduler has a thread of its own, which exchanges the newest reading and force with the 1 kHz loop
// (driver_exchange.hpp says why the loop is not run inside it, and what that costs). When the connection breaks, a third thread
// closes the device and opens it again once a second; readings are `gone` meanwhile.
//
// One device in a process: the library's own wrappers know no more on Linux. A driver that hangs inside a call cannot be closed;
// its memory is then left to it when this device is destroyed.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "client/device/device.hpp"
#include "client/device/driver_exchange.hpp"

namespace palpate {

namespace hd {
class Session;
}

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
  struct Shared;

  void keep_open() noexcept;
  void open_again() noexcept;
  bool stuck() const;

  std::string config_;
  std::unique_ptr<Shared> shared_;
  DeviceCaps caps_;
  std::atomic<bool> ends_{false};
  std::thread keeper_;
};

}  // namespace palpate
