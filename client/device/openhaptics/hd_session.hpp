// One device that libHD has open, and the task of its scheduler's thread once a millisecond:
//
//     begin frame, read errors, position, buttons, orientation and calibration, exchange them for the newest force
//     (driver_exchange.hpp), set force and torque, end frame, read errors.
//
// State is read and set between begin and end of one frame a tick, in the scheduler's thread alone, as HDAPI demands.
#pragma once

#include <atomic>
#include <string>

#include "client/device/device.hpp"
#include "client/device/driver_exchange.hpp"
#include "client/device/openhaptics/hd_abi.hpp"
#include "client/device/reading_gate.hpp"

namespace palpate::hd {

inline constexpr double kSchedulerHz = 1000;
/// Faster than people move a stylus; the library has another limit, which it does not report for every device.
inline constexpr double kVelocityMaxMS = 5;
inline constexpr double kSpinMaxRadS = 30;

class Session {
 public:
  /// Opens `config` (empty: the default device) and starts the scheduler. Throws InputError when there is no such device.
  Session(const Functions& functions, const std::string& config, DriverExchange& exchange);
  /// Makes sure that zero force was sent, then closes. Hangs as long as the driver does.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const DeviceCaps& caps() const { return caps_; }
  // any thread
  bool lost() const { return lost_.load(std::memory_order_acquire); }  ///< true: the connection broke; close, and open anew

 private:
  static unsigned int tick(void* self) noexcept;
  void turn() noexcept;
  DeviceReading measure() noexcept;
  void look_after(std::uint32_t buttons) noexcept;
  void take_errors() noexcept;
  void note(unsigned int code) noexcept;
  void read_caps();
  void read_torque_caps();
  void set_torque(const double* mnm) noexcept;
  [[noreturn]] void fail(const std::string& config, unsigned int code);

  const Functions& hd_;
  DriverExchange& exchange_;
  Handle handle_ = kInvalidHandle;
  SchedulerHandle scheduled_ = 0;
  DeviceCaps caps_;
  ReadingGate gate_;
  unsigned int calibration_ = calibration::kNeedsUpdate;
  unsigned int calibration_style_ = 0;
  int until_check_ = 0;
  std::uint32_t buttons_before_ = 0;
  bool torque_refused_ = false;
  std::atomic<bool> lost_{false}, closes_{false};
  std::atomic<std::uint64_t> turns_{0};
};

}  // namespace palpate::hd
