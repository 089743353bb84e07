// A HID device in the 1 kHz loop: `read` and `write` of the haptic thread access two mailboxes; two threads talk to the device.
//
//     reader   waits for input reports and passes the newest on; opens the device, and reopens it after it was unplugged
//     writer   sends the newest command; Linux's write waits for the transfer, up to a millisecond, and would delay the tick
//
// A force that is not renewed expires: kStale after the last write() the writer sends a disarmed command, whatever happened to
// the haptic thread. An unplugged device reads as `gone`, is searched for every kLookAgain, and returns only as the same device:
// with other limits than at first it stays `gone`, with the reason. halt() leaves the sending to the writer; when the whole
// process dies, the device's own watchdog is what remains.
#pragma once

#include <semaphore.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "client/device/device.hpp"
#include "client/device/hid/hid_protocol.hpp"
#include "common/base/latest_slot.hpp"

namespace palpate {

struct HidDeviceOptions {
  /// Opens the device. Returns nullptr when it is missing or may not be opened, with the reason in the string. Called by the
  /// constructor and then by the reader.
  std::function<std::unique_ptr<HidTransport>(std::string&)> open;
  std::string model;              ///< for reports
  void (*on_thread)() = nullptr;  ///< each thread calls it first, for example to request real time
};

class HidDevice final : public Device {
 public:
  static constexpr Micros kStale{20'000}, kLookAgain{300'000}, kReadWait{50'000};

  /// Opens the device and starts the threads. Throws InputError where it is missing or is not what `protocol` expects.
  HidDevice(std::unique_ptr<HidProtocol> protocol, HidDeviceOptions options);
  ~HidDevice() override;

  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override;
  /// A part that is not finite counts as zero, and all as disarmed while the last read() was not ok.
  void write(const Wrench& wrench) noexcept override;
  void stop() noexcept override;
  void halt() noexcept override;
  void resume() noexcept override { halted_.store(false, std::memory_order_release); }

 private:
  struct Heard {
    HidInput input;
    Micros at{};
  };
  void run_reader() noexcept;
  void run_writer() noexcept;
  bool listen() noexcept;
  bool open_again() noexcept;
  void publish(const HidInput& input) noexcept;
  void publish_gone(DeviceReason reason) noexcept;
  void send(const HidCommand& command) noexcept;
  void command(const HidCommand& command) noexcept;

  std::unique_ptr<HidProtocol> protocol_;
  HidDeviceOptions options_;
  DeviceCaps caps_;
  std::unique_ptr<HidTransport> transport_;  ///< changed by the reader, under use_
  std::mutex use_;                           ///< guards transport_ for the writer; the haptic thread never locks it
  HidInput input_;                           ///< owned by the reader
  LatestSlot<Heard> heard_;
  LatestSlot<HidCommand> commands_;
  Heard newest_;         ///< owned by the haptic thread
  bool was_ok_ = false;  ///< state of its last reading
  sem_t wake_;           ///< wakes the writer; sem_post may be called anywhere, also in a signal handler
  std::atomic<bool> end_{false}, halted_{false}, lost_{false};
  std::thread reader_, writer_;
};

}  // namespace palpate
