// Device `inverse3`: a Haply Inverse3 through Haply's Inverse Service on this machine.
//
// A thread of its own holds a WebSocket to the service and runs an Inverse3Session on it (inverse3_session.hpp); the loop meets
// only its DriverExchange, so that no tick waits for the service. Each device has a connection of its own, and several may be
// open at once. A lost connection, or a silence of a second, is followed by an attempt to connect once a second; the force begins
// at zero then. When the program ends, it sends zero force first; when it is killed, its connection closes, and the service has
// to act.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "client/device/driver_exchange.hpp"
#include "client/device/exchange_counter.hpp"
#include "client/device/inverse3/inverse3_messages.hpp"

namespace palpate {

struct Inverse3Options {
  static constexpr std::uint16_t kPort = 10001;  ///< the service's default
  std::string id = {};                           ///< device_id; empty: the only device that the service lists
  std::uint16_t port = kPort;
  void (*on_thread)() = nullptr;  ///< its thread calls it first, for example to request real time
};
/// Reads "[ID][,port=NUMBER]". Throws InputError.
Inverse3Options read_inverse3_options(std::string_view text);

/// Returns the devices that the service lists. Throws InputError where there is no service.
std::vector<Inverse3Inventory::Listed> find_inverse3(std::uint16_t port = Inverse3Options::kPort);

class Inverse3Device final : public Device {
 public:
  /// Throws InputError when the service is not there or does not list the device, or when it is of a type without known limits.
  explicit Inverse3Device(const Inverse3Options& options);
  ~Inverse3Device() override;

  const DeviceCaps& caps() const override { return caps_; }
  ExchangeFigures exchanges() const override { return counter_.figures(); }
  DeviceReading read(Micros) noexcept override { return exchange_.read(); }
  void write(const Wrench& wrench) noexcept override { exchange_.write(wrench); }
  void stop() noexcept override { exchange_.write({}); }
  void halt() noexcept override { exchange_.halt(); }
  void resume() noexcept override { exchange_.resume(); }

 private:
  struct Connection;
  void run(std::unique_ptr<Connection> connection) noexcept;
  std::unique_ptr<Connection> connect_again() noexcept;

  Inverse3Options options_;  ///< with the id of the device
  std::string type_;
  DeviceCaps caps_;
  DriverExchange exchange_;
  ExchangeCounter counter_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace palpate
