// One device that DHD has open, and one exchange with it:
//
//     read position, orientation, gripper and buttons, exchange them for the newest force (driver_exchange.hpp), send the force.
//
// A force is sent in every turn, zero where there is none: gravity compensation is computed on the host and sent along with it,
// so an arm without force commands sinks. Torque is sent to a device with an active wrist whose limit is known, else as zero, and
// the grip always. The device's own watchdog is armed: it switches the force off when the host, or this program, sends nothing
// for kWatchdog.
#pragma once

#include "client/device/device.hpp"
#include "client/device/driver_exchange.hpp"
#include "client/device/forcedimension/dhd_abi.hpp"
#include "client/device/reading_gate.hpp"

namespace palpate::dhd {

inline constexpr double kTurnHz = 2000;
inline constexpr double kVelocityMaxMS = 5;  ///< faster than people move a handle; the device has its own limit
inline constexpr double kSpinMaxRadS = 30;   ///< faster than people turn one
inline constexpr Micros kWatchdog{20'000};
inline constexpr double kGripperGapM = 0.025;  ///< between thumb and finger wide open, of an omega.7 and a sigma.7

class Session {
 public:
  /// Opens the device with that number, 0 is the first. Throws InputError when there is none or it is in use.
  Session(const Functions& functions, int index, DriverExchange& exchange);
  /// Sends zero force, switches the force off and closes.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const DeviceCaps& caps() const { return caps_; }
  bool lost() const { return lost_; }  ///< true: the connection broke; close, and open anew
  /// True when the device has to home, which moves it, before it can be used.
  bool must_home() const;
  /// Homes the device, which moves it for seconds. Returns false on failure.
  bool home() noexcept;
  void turn() noexcept;

 private:
  void read_caps(int index);
  DeviceReading measure() noexcept;
  void look_after_force() noexcept;
  void note(int code) noexcept;
  void check(int result) noexcept;
  [[noreturn]] void fail(int index) const;

  const Functions& dhd_;
  DriverExchange& exchange_;
  int id_ = -1;
  bool drd_ = false;
  DeviceCaps caps_;
  ReadingGate gate_;
  bool lost_ = false, not_ready_ = false;
  int until_check_ = 0, checks_without_force_ = 0;
};

}  // namespace palpate::dhd
